"""A load machine's torque that is measured drives the load, as the motors' torques drive the motor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.preconditions.thinned import thin
from estimator.diagnosis.preconditions.units import require_plausible_units
from estimator.errors import BadShape, Implausible
from estimator.physics.driveline import Start
from estimator.physics.free_run import free_run
from estimator.physics.grid import grid_for
from estimator.physics.layout import flat_values
from estimator.physics.simulate import simulate
from estimator.signals.record import Location, Record, sliced
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps

START = Start(5.0, 0.0, 2.0)
TORQUE, LOAD = random_steps(400, 1), random_steps(400, 2, size_nm=60.0, hold=25)


def braked(values: dict[str, float], location: Location = Location.MOTOR) -> Record:
    """Return a recording in which the load machine's torque acts and is measured."""
    record = linear_record(values, TORQUE, START, extra_load_nm=LOAD, location=location)
    return replace(record, load_nm=LOAD)


@pytest.mark.parametrize("location", [Location.MOTOR, Location.LOAD])
def test_it_acts_at_the_load(location: Location) -> None:
    record, start = braked(TWO_MASS, location), START
    simulated = simulate(grid_for(model(TWO_MASS), [record]), record, flat_values(TWO_MASS, {}), start)
    np.testing.assert_allclose(simulated, record.output, atol=1e-3 * np.ptp(record.output))


def test_a_free_run_finds_the_constant_load_besides_it() -> None:
    record = braked(ONE_MASS)
    run = free_run(model(ONE_MASS), record)
    assert run.start.load_torque_nm == pytest.approx(START.load_torque_nm, abs=1e-3)
    assert run.rms < 1e-4 * np.ptp(record.output)
    without = free_run(model(ONE_MASS), replace(record, load_nm=None))
    assert without.rms > 0.1 * np.std(record.output)


def test_a_part_and_a_thinned_recording_keep_it() -> None:
    record = braked(ONE_MASS)
    np.testing.assert_array_equal(sliced(record, slice(100, 300)).known_load_nm, LOAD[100:300])
    np.testing.assert_allclose(thin(record, 5).known_load_nm, LOAD.reshape(-1, 5).mean(axis=1))


def test_a_load_that_takes_most_of_the_torque_is_no_wrong_unit() -> None:
    torque = random_steps(3000, 1)
    load = 0.8 * torque
    record = replace(linear_record(ONE_MASS, torque, START, extra_load_nm=load), load_nm=load)
    require_plausible_units([record], model(ONE_MASS))
    with pytest.raises(Implausible):
        require_plausible_units([replace(record, load_nm=None)], model(ONE_MASS))


def test_a_load_beyond_all_torque_is_another_unit() -> None:
    record = braked(ONE_MASS)
    with pytest.raises(Implausible, match="its measured load torque reaches"):
        require_plausible_units([replace(record, load_nm=1000.0 * record.total_torque_nm)], model(ONE_MASS))


def test_it_has_a_number_in_every_row() -> None:
    with pytest.raises(BadShape, match="load_nm holds NaN"):
        replace(braked(ONE_MASS), load_nm=np.where(np.arange(400) == 7, np.nan, LOAD))
    with pytest.raises(BadShape, match="load_nm has shape"):
        replace(braked(ONE_MASS), load_nm=LOAD[:10])
