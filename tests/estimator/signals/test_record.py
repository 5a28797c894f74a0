"""What a record refuses, and what it says of its torques."""

import gc
from typing import Any

import numpy as np
import pytest

from estimator.errors import BadShape
from estimator.signals.record import Record, once, uniform_period_s


def record(**changed: Any) -> Record:
    fields: dict[str, Any] = {
        "name": "run",
        "sample_time_s": 0.01,
        "time_s": np.arange(4) * 0.01,
        "torque_nm": np.ones((4, 2)),
        "output": np.ones(4),
        "okay": np.ones(4, dtype=bool),
    }
    return Record(**(fields | changed))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"output": np.ones(3)}, "output has shape"),
        ({"okay": np.ones(5, dtype=bool)}, "okay has shape"),
        ({"torque_nm": np.ones(4)}, "torque_nm has shape"),
        ({"torque_nm": np.ones((4, 0))}, "torque_nm has shape"),
        ({"torque_nm": np.full((4, 1), np.nan)}, "holds NaN"),
        ({"output": np.full(4, np.nan)}, "holds NaN"),
        ({"torque_okay": np.ones(3, dtype=bool)}, "torque_okay has shape"),
        ({"torque_okay": np.ones((4, 3), dtype=bool)}, "torque_okay has shape"),
        ({"offset_s": np.zeros(3)}, "offset_s has shape"),
        ({"offset_s": np.full(4, np.nan)}, "offset_s holds NaN"),
    ],
)
def test_signals_of_the_wrong_shape_or_without_values_are_refused(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(BadShape, match=f"recording run: .*{said}"):
        record(**changed)


def test_every_torque_is_trusted_unless_given_otherwise() -> None:
    assert record().torque_trusted.tolist() == [[True, True]] * 4
    by_row = np.array([True, False, True, True])
    assert record(torque_okay=by_row).torque_trusted.tolist() == [[okay, okay] for okay in by_row]
    by_input = np.column_stack([by_row, ~by_row])
    np.testing.assert_array_equal(record(torque_okay=by_input).torque_trusted, by_input)


def recording(size: int) -> Record:
    time_s = 3.0 + 0.01 * np.arange(size)
    return Record("run", 0.01, time_s, np.ones((size, 2)), np.zeros(size), np.ones(size, dtype=bool))


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


@pytest.mark.parametrize("period_s", [0.01, 0.002, 0.0125, 0.1, 1.0 / 1024.0])
@pytest.mark.parametrize("start_s", [0.0, 1234.56])
def test_even_stamps_give_their_step(period_s: float, start_s: float) -> None:
    assert uniform_period_s(start_s + period_s * np.arange(3000)) == pytest.approx(period_s, rel=1e-8)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("jitter_s", [1e-4, 1e-3, 3e-3])
def test_jitter_does_not_spoil_it(seed: int, jitter_s: float) -> None:
    jitter = jitter_s * np.random.default_rng(seed).standard_normal(3000)
    assert uniform_period_s(0.01 * np.arange(3000) + jitter) == 0.01
