"""A real car on the road, of which only stretches are driven by the motor alone: segments, masks, and what is said.

The mass is within what J. Steinstraeter, J. Buberger and D. Trifonov's trips ("Battery and Heating Data in Real Driving
Cycles", IEEE DataPort 2020) gave in an own one-mass identification over 60 trips, about 1600 kg.
"""

import json
from pathlib import Path
from typing import Any

import pytest

from estimator.diagnosis.preconditions.prepare import prepare
from hil.cli.main import run
from hil.config.model_file import read_model
from hil.recording import read_records
from tests.real.conftest import real_recording

pytestmark = pytest.mark.campaign  # a diagnosis of a whole trip takes a minute

MODEL = Path(__file__).parents[2] / "examples" / "electric_car.toml"
TRIPS = ("A01", "A02", "A05", "A10", "A12", "A19", "A20", "A23")


@pytest.mark.parametrize("trip", TRIPS)
def test_trips_are_cut_and_believed(trip: str) -> None:
    """No trip is taken for one in other units, and most of what was driven is used."""
    file = read_model(MODEL)
    records = read_records([real_recording(f"ev_trips/Trip{trip}.csv")], file.signals)
    ready = prepare(records, file.model)
    (warning,) = ready.warnings
    assert warning.startswith(f"recording Trip{trip}: gaps of more than 1 s cut it into ")
    used = sum(int(record.okay.sum()) for record in ready.records)
    assert used > 0.8 * int(records[0].okay.sum())


@pytest.fixture(scope="module")
def verdict(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    out = tmp_path_factory.mktemp("car") / "out"
    trip = real_recording("ev_trips/TripA01.csv")
    assert run(["diagnose", str(trip), "--model", str(MODEL), "--out", str(out)]) == 0
    content: dict[str, Any] = json.loads((out / "diagnosis.json").read_text())
    return content


@pytest.mark.timeout(600)
def test_a_mismatch_is_found_and_reported_for_the_trip(verdict: dict[str, Any]) -> None:
    """Grade and drag are left out of the model: that something is missing must be seen, whatever it is called."""
    assert verdict["mismatch"]["detected"] is True
    assert list(verdict["mismatch"]["time_s"]) == list(verdict["load_torque"]) == ["TripA01"]
    assert "TripA01#" not in json.dumps(verdict)
    assert verdict["parameters"]["J_M"]["value"] == pytest.approx(1600.0, rel=0.1)
