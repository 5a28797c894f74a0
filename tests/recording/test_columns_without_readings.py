"""Torque columns with nothing in them, or never in the same row: refused in words, without a warning of NumPy's."""

from pathlib import Path

import numpy as np
import pytest

from hil.errors import RecordingError
from hil.recording.signals import read_record

ROWS = 200


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (np.ones(ROWS, dtype=bool), np.zeros(ROWS, dtype=bool)),
        (np.zeros(ROWS, dtype=bool), np.zeros(ROWS, dtype=bool)),
        (np.arange(ROWS) % 2 == 0, np.arange(ROWS) % 2 == 1),
    ],
    ids=["one is empty", "both are empty", "in turn"],
)
def test_they_are_refused_as_without_usable_samples(
    tmp_path: Path,
    first: np.ndarray[tuple[int], np.dtype[np.bool_]],
    second: np.ndarray[tuple[int], np.dtype[np.bool_]],
) -> None:
    path = tmp_path / "run.csv"
    rows = [
        f"{0.01 * k:.2f},{k % 7 if first[k] else ''},{k % 5 if second[k] else ''},{0.1 * k:.1f}" for k in range(ROWS)
    ]
    path.write_text("\n".join(["time_s,torque_m1_nm,torque_m2_nm,speed_rad_s", *rows]))
    with pytest.raises(RecordingError, match="expected 10 usable samples or more, got 0 of 200 rows"):
        read_record(path)
