"""What a record refuses, and what it says of its torques."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimator.errors import BadShape
from estimator.signals.record import Record


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
