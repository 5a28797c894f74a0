"""Whose the constant load torque is: each recording's own, all recordings', or known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.assemble import load_torques
from estimator.diagnosis.hypotheses import open_hypotheses
from estimator.errors import BadModel
from estimator.physics.driveline import Start
from estimator.physics.fit import FitResult, fit, make_problem
from estimator.physics.free_run import free_run
from estimator.physics.model import DrivelineModel, Load
from estimator.physics.unknowns import nominal_unknowns
from estimator.signals.record import Record
from tests.estimator.physics.bench import TWO_MASS, linear_record, model, random_steps

LOADS_NM = (20.0, 20.0)
SIGMA = 0.02


def one_way(direction: float, seed: int, load_nm: float) -> Record:
    """A cruise in one direction; dry friction of 6 Nm at the motor is a constant torque there."""
    friction = 6.0 * direction
    torque = random_steps(1500, seed, size_nm=40.0, mean_nm=direction * 60.0 + load_nm + friction)
    start = Start(load_nm, 0.0, direction * 60.0, 0.0, direction * 60.0)
    plain = linear_record(TWO_MASS, torque - friction, start, sigma=SIGMA, seed=seed, name=f"run_{seed}")
    return replace(plain, torque_nm=torque[:, np.newaxis])


FORWARD, BACK = one_way(1.0, 1, 20.0), one_way(-1.0, 2, 20.0)


def with_load(load: Load | float) -> DrivelineModel:
    return replace(model(TWO_MASS, 0.02), load=load)


def fitted(load: Load | float) -> FitResult:
    line = with_load(load)
    return fit(make_problem(line, [FORWARD, BACK], nominal_unknowns(line)))


def test_its_own_takes_up_dry_friction_in_each_direction() -> None:
    result = fitted(Load.OWN)
    loads = [each.value for each in load_torques(result, with_load(Load.OWN)).values()]
    assert loads == pytest.approx([26.0, 14.0], abs=1.0)
    assert result.rms == pytest.approx(SIGMA, rel=0.1)


@pytest.mark.parametrize("load", [Load.SHARED, 20.0])
def test_shared_or_known_it_leaves_dry_friction_to_be_seen(load: Load | float) -> None:
    result = fitted(load)
    loads = load_torques(result, with_load(load))
    assert len({each.value for each in loads.values()}) == 1
    assert result.rms > 5.0 * SIGMA
    low, high = loads["run_1"].ci95
    assert (low == high) == (load == 20.0)
    free = fitted(Load.OWN)
    assert free.free_count - result.free_count == (1 if load is Load.SHARED else 2)


def test_dry_friction_is_reported_in_one_direction_where_the_load_is_known_or_shared_by_both() -> None:
    def tells(load: Load | float, *records: Record) -> bool:
        return "coulomb_friction_motor" in open_hypotheses(with_load(load), records)[0]

    assert not tells(Load.OWN, FORWARD, BACK)
    assert tells(Load.SHARED, FORWARD, BACK)
    assert not tells(Load.SHARED, FORWARD)
    assert tells(20.0, FORWARD)


def test_of_one_recording_alone_a_shared_load_is_its_own_and_a_known_one_is_kept() -> None:
    assert free_run(with_load(Load.SHARED), FORWARD).start.load_torque_nm == pytest.approx(26.0, abs=1.0)
    assert free_run(with_load(26.0), FORWARD).start.load_torque_nm == 26.0
    assert free_run(with_load(20.0), FORWARD).rms > 2.0 * free_run(with_load(26.0), FORWARD).rms


def test_a_load_that_is_no_number_is_refused() -> None:
    with pytest.raises(BadModel, match=r"load\.constant: expected 'own', 'shared' or a finite number, got nan"):
        with_load(float("nan"))
