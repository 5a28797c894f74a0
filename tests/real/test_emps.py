"""A real linear drive whose nominal model leaves out dry friction: what the tool says of it, end to end.

The published identification is of Janot, Gautier and Brunot, "Data set and reference models of EMPS", Workshop on
Nonlinear System Identification Benchmarks, 2019; it appears here alone. Tolerances and the 2.6 mm are the
requirement's.
"""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

from hil.cli.main import run

MODEL = Path(__file__).parents[2] / "examples" / "emps.toml"

MASS_KG = 95.11
VISCOUS_N_S_M = 203.5
COULOMB_N = 20.39
OFFSET_N = -3.16


@pytest.fixture(scope="module")
def out(emps: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("emps") / "out"
    assert run(["diagnose", str(emps), "--model", str(MODEL), "--out", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def verdict(out: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((out / "diagnosis.json").read_text())
    return content


def test_names_dry_friction_and_nothing_else(verdict: dict[str, Any]) -> None:
    """What is left is a torque that goes with the motor's angle: the screw, which no published model of it has."""
    assert verdict["verdict"] in ("explained", "partly_explained")
    assert [effect["name"] for effect in verdict["effects"]] == ["coulomb_friction_motor"]
    assert verdict["mismatch"]["element"] == "motor"
    others = [rival["name"] for rival in verdict["rejected"]]
    assert "stribeck_friction" in [*others, *verdict["effects"][0]["indistinguishable_from"]]


def test_agrees_with_the_published_identification(verdict: dict[str, Any]) -> None:
    """To 15 %: the published law is sharp, and one with presliding leaves part of it to the viscous friction."""
    friction = verdict["effects"][0]["parameters"]["friction_nm"]
    assert verdict["parameters"]["J_M"]["value"] == pytest.approx(MASS_KG, rel=0.03)
    assert verdict["parameters"]["b_M"]["value"] == pytest.approx(VISCOUS_N_S_M, rel=0.15)
    assert friction["value"] == pytest.approx(COULOMB_N, rel=0.15)
    assert verdict["load_torque"]["DATA_EMPS"]["value"] == pytest.approx(OFFSET_N, rel=0.10)


def test_intervals_hold_the_published_values(verdict: dict[str, Any]) -> None:
    intervals = {
        MASS_KG: verdict["parameters"]["J_M"]["ci95"],
        VISCOUS_N_S_M: verdict["parameters"]["b_M"]["ci95"],
        COULOMB_N: verdict["effects"][0]["parameters"]["friction_nm"]["ci95"],
    }
    for published, (low, high) in intervals.items():
        assert low <= published <= high


def test_fit_improves_in_free_run_and_on_unseen_data(verdict: dict[str, Any]) -> None:
    fit = verdict["fit"]
    assert fit["unit"] == "m"
    assert fit["augmented"] <= 2.6e-3
    assert fit["retuned"] > 4.0e-3
    assert fit["holdout_augmented"] < 0.75 * fit["holdout_retuned"]


def test_augmented_model_simulates_the_recording(out: Path, emps: Path, tmp_path: Path) -> None:
    """The file written next to the verdict carries the finding: another command reproduces the error from it."""
    predicted = tmp_path / "pred.csv"
    model = str(out / "augmented.toml")
    assert run(["simulate", "--model", model, "--input", str(emps), "--out", str(predicted)]) == 0
    with predicted.open() as file:
        rows = list(csv.DictReader(file))
    name = next(column for column in rows[0] if column.startswith("position_sim"))
    simulated = np.array([float(row[name]) for row in rows])
    measured = loadmat(emps)["qm"].ravel()
    assert simulated.shape == measured.shape
    assert float(np.sqrt(np.mean((simulated - measured) ** 2))) <= 2.6e-3
