"""Load and initial state of an FMU on a recording: found as those of a model file are, though the shaft slips."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimator.physics.driveline import InitialCondition
from estimator.physics.free_run import free_run
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.model import DrivelineModel, EffectValue
from estimator.physics.simulate import simulate
from estimator.signals.record import Record
from hil.export.fmu import package
from hil.export.fmu.driveline import driveline
from hil.plants.fmu_plant import FmuPlant
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record

pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")

SLIPPING = {"shaft_hysteresis": {"friction_nm": 40.0, "yield_rad": 0.02, "sharpness": 10.0}}
SOFT = TWO_MASS | {"k": 0.01 * TWO_MASS["k"]}


def slipped() -> tuple[DrivelineModel, Record]:
    """Return a line whose shaft holds little beyond a level, and a recording of it that begins at speed, twisted."""
    torque = 5.0 + random_steps(400, seed=3, size_nm=80.0, hold=20)
    empty = record(torque, np.ones(400), name="slip")
    start = InitialCondition(5.0, 0.0, 30.0, 0.3, 25.0)
    out = simulate(grid_for(model(SOFT), [empty]), empty, flat_values(SOFT, SLIPPING), start)
    effects = {"shaft_hysteresis": {name: EffectValue(value) for name, value in SLIPPING["shaft_hysteresis"].items()}}
    line = replace(model(SOFT), effects=effects)
    noise = 0.02 * np.random.default_rng(1).standard_normal(out.size)
    return line, replace(empty, output=out + noise)


def test_an_fmu_follows_a_recording_as_well_as_the_model_it_is_of(tmp_path: Path) -> None:
    line, seen = slipped()
    package.write(driveline("drive", line, seen.sample_time_s), "2.0", tmp_path / "drive.fmu")
    found = FmuPlant(tmp_path / "drive.fmu", [], trusted=True).run(seen)
    assert found.rms < 1.1 * free_run(line, seen).rms
