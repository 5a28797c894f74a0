"""Recordings that can be read but not believed: refused, or reported and left out; never a crash, never a verdict on
them.

The drive is one mass of 2 kg m^2 whose speed is known in closed form (`tests.cli.bench`).
"""

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil.cli.main import run
from tests.bad_input.conftest import Refused
from tests.cli import bench

Signals = dict[str, np.ndarray]
Change = Callable[[Signals], None]

TIME, TORQUES, SPEED = "time_s", ("torque_m1_nm", "torque_m2_nm"), "speed_rad_s"


def changed(path: Path, change: Change) -> Path:
    """Rewrite a recording with its signals changed."""
    with path.open() as file:
        names = next(csv.reader(file))
    signals = dict(zip(names, np.loadtxt(path, delimiter=",", skiprows=1).T, strict=True))
    change(signals)
    columns = np.column_stack([signals[name] for name in names])
    np.savetxt(path, columns, delimiter=",", header=",".join(names), comments="", fmt="%.12g")
    return path


def times(factor: float, *names: str) -> Change:
    def scale(signals: Signals) -> None:
        for name in names:
            signals[name] *= factor

    return scale


def noise_alone(signals: Signals) -> None:
    rng = np.random.default_rng(1)
    for name in TORQUES:
        signals[name] = 3.0 + 0.1 * rng.standard_normal(signals[name].size)
    signals[SPEED] = 20.0 + 0.05 * rng.standard_normal(signals[SPEED].size)


def coasting(signals: Signals) -> None:
    rng = np.random.default_rng(1)
    for name in TORQUES:
        signals[name] = 1e-3 * rng.standard_normal(signals[name].size)
    signals[SPEED] = 60.0 * np.exp(-signals[TIME] / 40.0) + 0.05 * rng.standard_normal(signals[SPEED].size)


def scraps(signals: Signals) -> None:
    signals[SPEED][np.arange(signals[SPEED].size) % 300 >= 100] = np.nan


REFUSED: dict[str, tuple[Change, str]] = {
    "speed in rpm": (times(60.0 / (2.0 * math.pi), SPEED), "is the speed in rpm"),
    "speed in degrees per second": (times(180.0 / math.pi, SPEED), "is the output in degrees"),
    "torque in kNm": (times(1e-3, *TORQUES), "is the torque in kNm"),
    "time in ms": (times(1e3, TIME), "Is time in ms, expected s?"),
    "torque turned round": (times(-1.0, *TORQUES), "is the sign of torque or output turned round?"),
    "speed turned round": (times(-1.0, SPEED), "is the sign of torque or output turned round?"),
    "noise alone": (noise_alone, "expected more than the noise"),
    "coasting": (coasting, "the torque read excites nothing"),
    "gaps everywhere": (scraps, "none of which holds 2 s of good samples"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_refused_with_the_reason_and_nothing_is_written(refused: Refused, drive: Path, fault: str) -> None:
    change, said = REFUSED[fault]
    path = changed(drive / "run_1.csv", change)
    complaint = refused("diagnose", path, "--model", drive / "drive.toml", "--out", drive / "out")
    assert said in complaint
    assert not (drive / "out").exists()


def diagnosed(drive: Path) -> tuple[dict[str, Any], str]:
    """Diagnose the drive's recording; give the content of diagnosis.json and the report."""
    out = drive / "out"
    assert run(["diagnose", str(drive / "run_1.csv"), "--model", str(drive / "drive.toml"), "--out", str(out)]) == 0
    return json.loads((out / "diagnosis.json").read_text()), (out / "report.html").read_text()


def test_a_speed_that_is_cut_off_is_reported_and_left_out(drive: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def cut_off(signals: Signals) -> None:
        signals[SPEED] = np.minimum(signals[SPEED], np.quantile(signals[SPEED], 0.9))

    changed(drive / "run_1.csv", cut_off)
    found, report = diagnosed(drive)
    warning = found["warnings"][0]
    assert "recording run_1: the speed stands at its limit" in warning
    assert "10.0% of the rows: its reading is cut off there; these rows are not used" in warning
    assert "its reading is cut off there" in report
    assert "its reading is cut off there" in " ".join(capsys.readouterr().out.split())
    assert found["verdict"] == "no_mismatch"
    assert found["parameters"]["J_M"]["value"] == pytest.approx(bench.J, rel=0.01)


def test_a_long_gap_is_bridged_by_a_new_start_and_reported(drive: Path) -> None:
    """For 3 s nothing was read, and the drive was stopped and started again meanwhile."""

    def interrupted(signals: Signals) -> None:
        later = bench.speed(2.0 * signals[TORQUES[0]][900:], -4.0)
        signals[SPEED][900:] = later + 0.02 * np.random.default_rng(2).standard_normal(later.size)
        for name in (*TORQUES, SPEED):
            signals[name][600:900] = np.nan

    changed(drive / "run_1.csv", interrupted)
    found, report = diagnosed(drive)
    (warning,) = found["warnings"]
    assert "recording run_1: gaps of more than 1 s cut it into 2 segments" in warning
    assert "gaps of more than 1 s" in report
    assert "run_1#" not in json.dumps(found) + report
    assert found["verdict"] == "no_mismatch"
    assert list(found["load_torque"]) == ["run_1"]
    assert found["load_torque"]["run_1"]["value"] == pytest.approx(bench.LOAD, abs=0.1)
    assert found["fit"]["retuned"] == pytest.approx(0.02, rel=0.1)
