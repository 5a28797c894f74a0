"""What can't be watched is refused before the screen is taken, with its status and what to do."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from hil.cli.main import run
from tests.monitor.terminal import LEAVE_SCREEN, Terminal

NOWHERE = ("--bus", "ws://127.0.0.1:9/", "--modbus", "127.0.0.1:9")
PICTURE = ("--snapshot", "picture.svg")

pytestmark = pytest.mark.timeout(300)


def test_without_a_terminal(rig_path: Path) -> None:
    command = [sys.executable, "-m", "hil", "monitor", str(rig_path)]
    ended = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert ended.returncode == 2
    assert "expected a terminal" in ended.stderr
    assert "ssh -t" in ended.stderr
    assert ended.stdout == ""


@pytest.mark.parametrize(("columns", "rows"), [(79, 24), (80, 23)])
def test_a_terminal_that_is_too_small(rig_path: Path, columns: int, rows: int) -> None:
    with Terminal("monitor", str(rig_path), columns=columns, rows=rows) as terminal:
        assert terminal.await_end() == 2
        assert f"at least 80 x 24, got {columns} x {rows}" in " ".join(terminal.text.split())
        assert LEAVE_SCREEN not in terminal.output  # it was never taken


@pytest.mark.campaign
def test_a_rig_that_is_not_there(rig_path: Path, tmp_path: Path) -> None:
    with Terminal("monitor", str(rig_path), *NOWHERE, "--out", str(tmp_path / "runs")) as terminal:
        assert terminal.await_end() == 3
        assert LEAVE_SCREEN in terminal.output
        assert terminal.settings == terminal.settings_before
        assert "ws://127.0.0.1:9/" in terminal.text
    assert not (tmp_path / "runs").exists()


def identification(period_s: float, filter_l: list[float]) -> dict[str, object]:
    """What of an identification.json an on-line estimate is made from."""
    settings = {"na": 4, "nb": 4, "nk": 1, "sample_time_s": period_s, "high_pass_hz": 0.3}
    recording = {"name": "run_1", "output": "speed", "filter_L": filter_l}
    return {"schema": "hil.identification/1", "settings": settings, "recordings": [recording]}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "rig file to watch, or --replay"),
        (("RIG", "--page", "poles"), "overview, model, resonance, bus, log"),
        (("RIG", "--size", "80"), "COLSxROWS"),
        (("RIG", "--replay", "r.csv", "--simulate"), "got both"),
        (("RIG", "--replay", "r.csv"), "r.csv"),
        (("RIG", "--model", "one_mass.toml"), "two_mass"),
        (("RIG", "--out", "rig.toml"), "is a file"),
        (("RIG", "--modbus", "nowhere"), "HOST:PORT"),
        (("RIG", "--filter-run", "run_1"), "expected --filter FILE with it"),
        (("RIG", "--filter", "identification.json"), "expected identification.json"),
        (("RIG", "--filter", "other_period.json"), "samples come every 0.01 s"),
        (("RIG", "--filter", "unstable.json"), "root of magnitude 1.2"),
        (("NO_SIMULATION", "--simulate"), "[simulation]"),
    ],
)
def test_wrong_use(
    rig_path: Path,
    arguments: tuple[str, ...],
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(rig_path.parent)
    text = rig_path.read_text(encoding="utf-8")
    Path("real.toml").write_text(text[: text.index("\n[simulation]")], encoding="utf-8")
    Path("one_mass.toml").write_text(
        'schema = "hil.model/1"\nstructure = "one_mass"\n[parameters]\n'
        "J_M = { value = 1.0, tolerance = 0.1 }\nb_M = { value = 0.1, tolerance = 0.1 }\n",
        encoding="utf-8",
    )
    for name, period_s, filter_l in (("other_period", 0.015, [1.0, -0.5]), ("unstable", 0.02, [1.0, -1.2])):
        Path(f"{name}.json").write_text(json.dumps(identification(period_s, filter_l)), encoding="utf-8")
    names = {"RIG": "rig.toml", "NO_SIMULATION": "real.toml"}
    assert run(["monitor", *(names.get(word, word) for word in arguments), *PICTURE]) == 2
    assert said in capsys.readouterr().err
    assert not Path("picture.svg").exists()
