"""What follows from a recording is worked out once and goes with it."""

from __future__ import annotations

import gc

import numpy as np

from estimator.signals.record import MOST_BYTES, Record, once


def recording(size: int) -> Record:
    time_s = 3.0 + 0.01 * np.arange(size)
    return Record("run", 0.01, time_s, np.ones((size, 2)), np.zeros(size), np.ones(size, dtype=bool))


def test_it_is_worked_out_once_for_each() -> None:
    asked = []

    @once
    def length(record: Record) -> int:
        asked.append(record.time_s.size)
        return record.time_s.size

    one, other = recording(5), recording(7)
    assert [length(one), length(other), length(one), length(other)] == [5, 7, 5, 7]
    assert asked == [5, 7]


def test_recordings_alike_are_not_taken_for_each_other() -> None:
    one, other = recording(5), recording(5)
    assert one.total_torque_nm is one.total_torque_nm
    assert one.total_torque_nm is not other.total_torque_nm
    np.testing.assert_allclose(one.since_start_s, 0.01 * np.arange(5), atol=1e-12)


def test_an_hour_is_not_kept_a_second_time() -> None:
    short, long = recording(MOST_BYTES // 8), recording(MOST_BYTES // 8 + 1)
    assert short.total_torque_nm is short.total_torque_nm
    assert long.total_torque_nm is not long.total_torque_nm
    np.testing.assert_array_equal(long.total_torque_nm, 2.0)


def test_it_is_forgotten_with_the_recording() -> None:
    class Weight:
        alive = 0

        def __init__(self) -> None:
            Weight.alive += 1

        def __del__(self) -> None:
            Weight.alive -= 1

    @once
    def weigh(record: Record) -> Weight:
        return Weight()

    record = recording(5)
    weigh(record)
    assert Weight.alive == 1
    del record
    gc.collect()
    assert Weight.alive == 0
