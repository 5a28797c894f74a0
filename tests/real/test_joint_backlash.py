"""A real friction joint with backlash on a test bench, against a nominal model of spring and damper alone.

Coble, Huggins, Cao, Ricles and Downey, "Dataset-Friction-Damper-with-Backlash", 2022: a stick-slip slider in series
with a gap of 4.06 mm (0.160 in), which appears here alone. Two sines are for the fit; another amplitude, two other
frequencies and an earthquake are not. The NRMSE is the RMS error over the standard deviation of the force.

The bounds below were set with results in view; they guard against getting worse and prove no more.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimator.physics.free_run import free_run
from hil.cli.main import run
from hil.config.model_file import ModelFile, read_model
from hil.recording import read_record
from tests.real.conftest import real_recording

pytestmark = pytest.mark.campaign  # two recordings are fitted, four held out: minutes

MODEL = Path(__file__).parents[2] / "examples" / "joint.toml"

TRAINING = ("sine_0.5Hz_0.5in", "sine_0.5Hz_1in")
UNSEEN = {
    "sine_1Hz_1in": 0.25,
    "sine_0.5Hz_1.5in": 0.25,
    "sine_0.25Hz_0.5in": 0.25,
    "earthquake_ImperialValleyDBE": 0.56,
}
"""Most NRMSE of the augmented model: a trial with slider and gap left 0.23 in the sines and 0.56 in the earthquake."""

GAP_M = 4.06e-3


def bench(name: str) -> Path:
    return real_recording(f"joint_backlash/{name}.csv")


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("joint") / "out"
    recordings = [str(bench(name)) for name in TRAINING]
    unseen = [str(bench(name)) for name in UNSEEN]
    assert run(["diagnose", *recordings, "--model", str(MODEL), "--out", str(folder), "--holdout", *unseen]) == 0
    return folder


@pytest.fixture(scope="module")
def verdict(out: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((out / "diagnosis.json").read_text())
    return content


def nrmse(file: ModelFile, name: str) -> float:
    record = read_record(bench(name), file.signals, file.on_bench)
    return free_run(file.model, record).rms / float(np.std(record.output))


def test_names_the_slider_and_the_gap(verdict: dict[str, Any]) -> None:
    assert verdict["verdict"] in ("explained", "partly_explained")
    assert {effect["name"] for effect in verdict["effects"]} == {"shaft_hysteresis", "backlash"}
    assert verdict["mismatch"]["element"] == "shaft"
    assert verdict["fit"]["unit"] == "N"


def test_the_gap_is_of_the_right_size(verdict: dict[str, Any]) -> None:
    gap = next(effect for effect in verdict["effects"] if effect["name"] == "backlash")["parameters"]["gap_rad"]
    assert gap["value"] == pytest.approx(GAP_M, rel=0.1)
    assert gap["ci95"][0] < GAP_M < gap["ci95"][1]


@pytest.mark.parametrize("name", UNSEEN)
def test_a_test_not_used_for_the_fit_is_predicted(out: Path, name: str) -> None:
    before, after = nrmse(read_model(MODEL), name), nrmse(read_model(out / "augmented.toml"), name)
    assert after < UNSEEN[name]
    assert after < 0.6 * before
