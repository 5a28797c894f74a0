"""``hil look`` without a model: scales and columns that are wrong by themselves, with the line that cures them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hil.cli.main import run
from tests.cli import bench

Columns = dict[str, np.ndarray]


def recorded(path: Path) -> Columns:
    """Return the columns of a drive whose inverters share the torque unequally."""
    bench.record(path, 1, noise=0.02, n=3000)
    time, first, second, speed = np.loadtxt(path, delimiter=",", skiprows=1).T
    share = np.where(np.sin(0.4 * time) > 0.0, 0.4, -0.4) * (first + second)
    return {"t": time, "T_1": first + share, "T_2": second - share, "w": speed}


def one_turned(columns: Columns) -> Columns:
    return {**columns, "T_2": -columns["T_2"]}


def output_turned(columns: Columns) -> Columns:
    return {**columns, "w": -columns["w"]}


def in_rpm(columns: Columns) -> Columns:
    return {**columns, "w": columns["w"] * 200.0 * 30.0 / np.pi, "T_1": columns["T_1"] * 200.0}


def per_mille(columns: Columns) -> Columns:
    return {**columns, "T_1": np.round(columns["T_1"] * 5.0), "T_2": np.round(columns["T_2"] * 5.0)}


def looked(tmp_path: Path, columns: Columns, capsys: pytest.CaptureFixture[str]) -> tuple[Path, str, str]:
    path = tmp_path / "drive.csv"
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.12g")
    assert run(["look", str(path)]) == 0
    said = capsys.readouterr()
    return path, said.out, said.err


@pytest.mark.parametrize(
    ("spoilt", "what", "line"),
    [
        (
            one_turned,
            "sign of torque input 2 turned round",
            'torque = [ { column = "T_1" }, { column = "T_2", scale = -1 } ]',
        ),
        (output_turned, "fall where the torque rises", 'speed = { column = "w", scale = -1, at = "motor" }'),
        (in_rpm, "Is it in rpm?", 'speed = { column = "w", scale = 0.10472, at = "motor" }'),
        (per_mille, "per mille of the rated torque", 'torque = [ { column = "T_1", scale = 0.001 }, '),
    ],
)
def test_what_is_wrong_is_named_with_the_line_that_cures_it(
    spoilt: Callable[[Columns], Columns], what: str, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, _, err = looked(tmp_path, spoilt(recorded(tmp_path / "run.csv")), capsys)
    assert what in err
    assert line in err
