"""A wrong scale is reported with the line that cures it wherever a recording meets a model, not only in a diagnosis."""

from pathlib import Path

import pytest

from hil.cli.main import run
from hil.recording import Table, csv_format, read_table
from tests.cli import bench

COLUMNS = ("time_s", "torque_m1_nm", "torque_m2_nm", "speed_rad_s")


@pytest.fixture
def in_millinewton(tmp_path: Path) -> tuple[str, str]:
    """Return a model file, and a recording whose torques are in mNm."""
    path = tmp_path / "run_1.csv"
    bench.record(path, 1, noise=0.05)
    numbers = read_table(path).numeric(list(COLUMNS))
    for name in ("torque_m1_nm", "torque_m2_nm"):
        numbers[name] = 1000.0 * numbers[name]
    csv_format.write(Table(path, numbers), path)
    return str(bench.model(tmp_path / "drive.toml")), str(path)


@pytest.mark.parametrize("command", ["compare", "identify", "look"])
def test_it_is_reported_with_the_line_that_cures_it(
    command: str, in_millinewton: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, recording = in_millinewton
    lines = {
        "compare": ["compare", model, recording],
        "identify": ["identify", recording, "--model", model, "--out", str(tmp_path / "out")],
        "look": ["look", recording, "--model", model],
    }
    assert run(lines[command]) == 0
    said = capsys.readouterr().err
    assert "run_1 is implausible" in said
    assert 'In [signals] write: torque = [ { column = "torque_m1_nm", scale = 0.001 }' in said


def test_a_scale_that_fits_is_no_note(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bench.record(tmp_path / "run_1.csv", 1, noise=0.05)
    assert run(["compare", str(bench.model(tmp_path / "drive.toml")), str(tmp_path / "run_1.csv")]) == 0
    assert "implausible" not in capsys.readouterr().err
