"""``hil commission``: plan, refusals, exit statuses, and the way on after Ctrl-C and after a kill."""

import json
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from hil.cli.main import run
from hil.commission.engine import MOST_VEHICLE_S, NAMES
from tests.cli.conftest import EXAMPLE, await_rows
from tests.commission.rigs import Bench, bench
from tests.rig.observer import assert_disarmed
from tests.rig.serving import addresses, served

NOWHERE = ("--bus", "ws://127.0.0.1:9/", "--modbus", "127.0.0.1:9")


def skipping_all_but(*steps: str) -> list[str]:
    skipped = [word for name in NAMES if name not in steps for word in ("--skip", name)]
    return [*skipped, "--because", "not under test"]


def command(rig: Bench, *options: str) -> list[str]:
    words = ["commission", str(rig.source.path), "--out", str(rig.folder), "--pace", "fast"]
    return [*words, *addresses(rig.server), *options]


def test_plan_keeps_the_vehicle_for_less_than_forty_minutes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run(["commission", str(EXAMPLE), "--out", str(out), "--dry-run", "--json", *NOWHERE]) == 0
    plan = json.loads(capsys.readouterr().out)
    assert [step["name"] for step in plan["steps"]] == list(NAMES)
    driven = {step["name"]: step["runs"] for step in plan["steps"] if step["runs"]}
    assert list(driven) == ["noise", "signs", "scales", "friction", "prbs", "experiments"]
    assert len([each for each in driven["experiments"] if each["name"].startswith("cruise")]) == 8
    assert sum(each["seconds"] for runs in driven.values() for each in runs) < plan["vehicle_s"] < MOST_VEHICLE_S
    assert all(abs(torque) <= 400.0 for runs in driven.values() for each in runs for torque in each["torque_m1_nm"])
    assert not out.exists()


@pytest.mark.parametrize(
    ("options", "reported"),
    [
        (["--skip", "noise"], "expected a reason"),
        (["--skip", "noise", "--because", " "], "expected a reason"),
        (["--because", "so"], "expected a reason"),
        (["--skip", "coffee", "--because", "tired"], "expected one of devices, limits"),
        (["--repeat", "coffee"], "expected one of devices, limits"),
        (["--skip", "noise", "--because", "so", "--repeat", "noise"], "got both"),
    ],
)
def test_wrong_use_is_refused_and_nothing_written(
    options: list[str], reported: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["commission", str(EXAMPLE), "--out", str(tmp_path / "out"), *options, *NOWHERE]) == 2
    assert reported in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_result_for_scripts_and_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with bench(tmp_path) as rig:
        assert run(command(rig, "--yes", "--json", *skipping_all_but("noise"))) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["complete"]
    assert result["steps"]["noise"]["status"] == "done"
    assert result["steps"]["signs"]["because"] == "not under test"
    assert {finding["within"] for finding in result["steps"]["noise"]["findings"]} == {True}
    page = Path(result["report"]).read_text(encoding="utf-8")
    kept = json.loads(Path(result["report"]).with_name("commission.json").read_text(encoding="utf-8"))
    assert result["made"] == kept["made"]
    assert result["made"]["command"].startswith("hil commission ")
    assert result["made"]["models"][0]["file"] == str(rig.source.path)
    assert all(each["sha256"] in page for each in result["made"]["recordings"])
    assert result["made"]["recordings"]
    assert "Noise at standstill" in page
    assert "speed noise (RMS)" in page
    assert "not under test" in page


@pytest.mark.timeout(300)  # a process of its own, at its own pace; a busy machine starts it late
@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), pytest.param(signal.SIGKILL, -9, marks=pytest.mark.campaign)]
)
def test_signal_in_the_middle_and_the_way_on(
    number: signal.Signals, status: int, spawn: Callable[..., subprocess.Popen[str]], short_rig: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with served(bus_url="ws://127.0.0.1:0/") as (server, _):
        words = [
            "commission",
            str(short_rig),
            "--out",
            str(out),
            "--yes",
            *addresses(server),
            *skipping_all_but("noise"),
        ]
        process = spawn(*words)
        await_rows(out / "runs" / "noise-rest.part.csv", process)
        process.send_signal(number)
        process.communicate(timeout=60)
        assert process.returncode == status
        if number is not signal.SIGKILL:  # then the drives themselves have to notice, see test_dead_host
            assert_disarmed(server.bus_url, 1, 2)
        before = json.loads((out / "commission.json").read_text(encoding="utf-8"))
        assert before["steps"]["noise"]["status"] in ("interrupted", "running")
        assert run([*words, "--pace", "fast"]) == 0
    after = json.loads((out / "commission.json").read_text(encoding="utf-8"))
    noise = after["steps"]["noise"]
    assert (noise["status"], noise["attempt"]) == ("done", 2)
    assert noise["history"][0]["status"] == "interrupted"
    assert (out / noise["runs"][-1]["recording"]).exists()
