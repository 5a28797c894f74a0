"""Recordings in blocks: how long they are, what counts in them, and which are used."""

from __future__ import annotations

import numpy as np

from estimator.diagnosis.line.blocks import block_mean, block_mean_of, lines, spread_stretches
from estimator.diagnosis.line.tangent import block_length
from estimator.physics.driveline import Start
from estimator.physics.fit import fit
from estimator.physics.problem import make_problem
from tests.estimator.diagnosis.planted import drive_torque
from tests.estimator.physics.bench import SPEED, TWIST, TWO_MASS, exact_states, linear_record, model, record

START = Start(5.0, 0.0, 2.0, 0.0, 2.0)


def test_fast_sampling_is_cut_into_blocks_and_slow_sampling_is_not() -> None:
    states = exact_states(TWO_MASS, drive_torque(1), START, sample_time_s=1e-3)
    slow = linear_record(TWO_MASS, drive_torque(1), START)
    fast = record(drive_torque(1), states[:, SPEED], sample_time_s=1e-3)
    result = fit(make_problem(model(TWO_MASS), [fast], ()))
    length = block_length(result)
    assert 5 <= length <= 10
    assert block_length(fit(make_problem(model(TWO_MASS), [slow], ()))) == 1
    (line,) = lines(result)
    assert line.size == 1500 // length
    middle = block_mean(states[:, TWIST], length)
    assert np.max(np.abs(line.motion.twist - middle)) < 0.02 * np.ptp(middle)


def test_masked_samples_do_not_count_in_a_block() -> None:
    values, use = np.array([1.0, 99.0, 3.0, 4.0, 99.0, 99.0]), np.array([True, False, True, True, False, False])
    mean, weight = block_mean_of(values, use, 2)
    np.testing.assert_array_equal(mean, [1.0, 3.5, 0.0])
    np.testing.assert_array_equal(weight, [1, 2, 0])


def test_a_long_recording_is_used_in_stretches_from_end_to_end() -> None:
    used = spread_stretches(100_000, 10_000)
    assert used.sum() == 9_000
    assert used[0]
    assert used[-1]
    assert spread_stretches(500, 10_000).all()


def test_a_line_that_grew_slower_keeps_its_blocks_where_they_are_asked_for() -> None:
    """A law over blocks is one of that length: blocks of the slower line's own would not match it."""
    stiff = {**TWO_MASS, "k": 4.0 * TWO_MASS["k"]}
    fast = record(drive_torque(1), exact_states(stiff, drive_torque(1), START, 1e-3)[:, SPEED], sample_time_s=1e-3)
    slower = fit(make_problem(model(TWO_MASS), [fast], ()))
    length = block_length(fit(make_problem(model(stiff), [fast], ())))
    assert block_length(slower) > length
    (line,) = lines(slower, length=length)
    assert line.length == length
    assert line.size == 1500 // length
