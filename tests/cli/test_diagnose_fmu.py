"""``hil diagnose`` with an FMU: what acts at its inputs and outputs is named, and it runs only where it is trusted."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from hil.cli.main import run
from hil.errors import UsageError
from hil.export.fmu import package
from hil.plants.names import names
from tests.cli import bench

LATE = 3
"""Samples by which the torque acts later than it was read."""


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("exported")
    (folder / "drive.toml").write_text(bench.MODEL)
    assert run(["export", "fmu", str(folder / "drive.toml"), "--out", str(folder / "drive.fmu")]) == 0
    return str(folder / "drive.fmu")


def late(path: Path) -> str:
    """Write a recording under other names, its torque read earlier than it acted."""
    bench.record(path, 1, noise=0.02, n=350)
    time, first, second, speed = np.loadtxt(path, delimiter=",", skiprows=1).T
    rows = slice(0, time.size - LATE)
    columns = [time[rows], (first + second)[LATE:], speed[rows]]
    np.savetxt(path, np.column_stack(columns), delimiter=",", header="t,T,w", comments="", fmt="%.12g")
    return str(path)


SIGNALS = """[signals]
time = { column = "t" }
torque = [{ column = "T" }]
speed = { column = "w" }
"""


def test_what_acts_at_an_input_is_named(fmu: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording, out = late(tmp_path / "run_1.csv"), tmp_path / "out"
    (tmp_path / "signals.toml").write_text(SIGNALS)
    mapped = [word for each in ("torque=T_M1", "output=speed_motor", "start=start.speed") for word in ("--map", each)]
    given = ["--signals", str(tmp_path / "signals.toml"), "--trust-fmu", *mapped, "--effort", "quick"]
    assert run(["diagnose", recording, "--model", fmu, "--out", str(out), *given]) == 0
    found = json.loads((out / "diagnosis.json").read_text())
    assert [effect["name"] for effect in found["effects"]] == ["transport_delay"]
    delay = found["effects"][0]["parameters"]["delay_s"]["value"]
    assert delay == pytest.approx(LATE * bench.DT, rel=0.05)
    assert found["fit"]["augmented"] == pytest.approx(0.02, rel=0.15)
    assert found["parameters"] == {}  # nothing inside an FMU is re-tuned
    assert [each["file"] for each in found["made"]["models"]] == [fmu]
    assert {path.name for path in out.iterdir()} == {"diagnosis.json", "report.html"}


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ([], "runs only where you trust it: --trust-fmu"),
        (["--trust-fmu", "--map", "output=w"], "expected a variable of the FMU, got 'w'. It has: "),
        (["--trust-fmu", "--map", "start=J_M"], "expected a finite speed_measured over run_1, got NaN or infinity"),
    ],
)
def test_what_is_not_trusted_or_named_is_refused(
    more: list[str], said: str, fmu: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bench.record(tmp_path / "run_1.csv", 1, n=300)
    assert run(["diagnose", str(tmp_path / "run_1.csv"), "--model", fmu, "--out", str(tmp_path / "out"), *more]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["torque=T_M1,T_M1"], "expected each name once"),
        (["output=speed_motor,speed_load"], "expected one name"),
        (["torque=T_M1", "torque=T_M2"], "expected torque once, got it twice"),
        (["speed=w"], "KEY one of torque, output, load, start"),
        (["load=w"], "load=w: expected a variable of the FMU"),
    ],
)
def test_what_map_can_not_mean_is_refused(given: list[str], said: str) -> None:
    with pytest.raises(UsageError, match=re.escape(said)):
        names(given, ("T_M1", "T_M2", "speed_measured", "speed_load"))


HANGS = """#include <fcntl.h>
#include <unistd.h>
fmi2Status fmi2EnterInitializationMode(Instance c) {{
    int begun = open("{counter}", O_WRONLY | O_CREAT | O_APPEND, 0600);
    if (write(begun, "x", 1) != 1 || lseek(begun, 0, SEEK_END) == {good} + 1) for (;;) pause();
    close(begun);
    """


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize(("good", "status"), [(0, 2), pytest.param(60, 0, marks=pytest.mark.campaign)])
def test_one_that_hangs_ends_with_the_budget(
    good: int, status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """At its first simulation there is no diagnosis; at a later one, once, nothing is decided."""
    before, own = "fmi2Status fmi2EnterInitializationMode(Instance c) { ", package.own
    assert before in own("fmi2.c")
    hangs = HANGS.format(counter=tmp_path / "begun", good=good)
    monkeypatch.setattr(package, "own", lambda name: own(name).replace(before, hangs))
    (tmp_path / "drive.toml").write_text(bench.MODEL)
    export = ["export", "fmu", str(tmp_path / "drive.toml"), "--fmi", "2.0", "--out", str(tmp_path / "drive.fmu")]
    assert run(export) == 0
    bench.record(tmp_path / "run_1.csv", 1, n=300)
    given = [
        "--model",
        str(tmp_path / "drive.fmu"),
        "--trust-fmu",
        "--budget-s",
        "20" if good else "3",
        "--out",
        str(tmp_path / "out"),
    ]
    capsys.readouterr()
    assert run(["diagnose", str(tmp_path / "run_1.csv"), *given]) == status
    printed = capsys.readouterr()
    expected = "Not decided: the search was ended after 20 s" if good else "in 3 s (--budget-s)"
    assert expected in printed.out + printed.err
    assert len((tmp_path / "begun").read_bytes()) > good
