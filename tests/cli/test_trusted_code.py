"""No code comes with a file: laws run only where they are trusted, and no process imports from its working folder."""

import sys
from pathlib import Path

import pytest

from estimator.diagnosis import first_use
from hil.cli.main import run
from hil.proof.command import run_hil
from hil.proof.rigs import sealed_process
from tests.cli import bench

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"

RAN = "ran.txt"
MODULE = f"""
from pathlib import Path
Path(__file__).with_name("{RAN}").write_text("ran")
def drag(time_s, motor_speed, load_speed, twist, torque, size):
    return size * motor_speed
"""
LAW = """
[laws.retarder]
function = "laws_of_another:drag"
element = "motor"
parameters = { size = { low = 0.0, high = 50.0, start = 1.0 } }
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Recordings, models and a rig file of someone else, with a law."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, "laws_of_another", raising=False)
    (tmp_path / "laws_of_another.py").write_text(MODULE)
    for name in ("a.csv", "b.csv"):
        bench.record(tmp_path / name, len(name))
    bench.model(tmp_path / "drive.toml", bench.MODEL + LAW)
    text = (EXAMPLES / "rig.toml").read_text("utf-8").replace("\n[simulation]", '\n[simulation]\nmodel = "drive.toml"')
    (tmp_path / "rig.toml").write_text(text, "utf-8")
    return tmp_path


@pytest.mark.parametrize(
    "line",
    [
        "diagnose a.csv b.csv --model drive.toml --out out",
        "simulate --model drive.toml --input a.csv --out out.csv",
        "compare drive.toml a.csv",
        "identify a.csv --model drive.toml --out out",
        "paper a.csv b.csv --model drive.toml --out out",
        "replay a.csv --model drive.toml",
        "run rig.toml cruise --dry-run",
        "sim rig.toml",
        "commission rig.toml --model drive.toml --out out --dry-run",
        "monitor rig.toml --model drive.toml --snapshot out.svg",
        "monitor rig.toml --simulate --snapshot out.svg",
    ],
)
def test_no_command_runs_the_laws_of_a_file_that_is_not_trusted(
    folder: Path, capsys: pytest.CaptureFixture[str], line: str
) -> None:
    assert run(line.split()) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "drive.toml: laws.retarder | expected --trust-laws" in said
    assert f"it would run laws_of_another:drag of {folder}" in said
    assert not (folder / RAN).exists()


def test_a_trusted_law_runs(folder: Path) -> None:
    run(["run", "rig.toml", "cruise", "--dry-run", "--trust-laws"])
    assert (folder / RAN).exists()


TRAP = f"""
from pathlib import Path
Path(__file__).with_name("{RAN}").write_text(__name__)
raise SystemExit(7)
"""


@pytest.fixture
def trapped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with modules of the names that processes import first."""
    place = tmp_path / "theirs"
    place.mkdir()
    for name in ("pickle", "typer", "numpy", "multiprocessing", "hil", "estimator", "can", "encodings", "asammdf"):
        (place / f"{name}.py").write_text(TRAP)
    monkeypatch.chdir(place)
    return place


@pytest.mark.campaign
def test_the_public_command_of_a_proof_runs_nothing_of_the_cases_folder(trapped: Path) -> None:
    run_hil(["effects"], trapped, 60.0)
    assert not (trapped / RAN).exists()


@pytest.mark.campaign
def test_a_sealed_rig_runs_nothing_of_the_folder(trapped: Path) -> None:
    with sealed_process("--seed", "5") as sealed:
        assert sealed.commitment
    assert not (trapped / RAN).exists()


@pytest.mark.campaign
def test_compiling_runs_nothing_of_the_folder(trapped: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_use, "SIDE_BY_SIDE", ((), ()))
    first_use.compile_kernels(2)
    assert not (trapped / RAN).exists()
