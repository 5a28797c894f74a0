"""Recordings small enough to know every cell."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hil.recording import Table

N_ROWS = 40


@pytest.fixture
def own_table() -> Table:
    """A recording with the contract's columns."""
    rng = np.random.default_rng(5)
    return Table(
        Path("run_1.csv"),
        {
            "time_s": np.arange(N_ROWS) * 0.01,
            "torque_m1_nm": rng.normal(size=N_ROWS),
            "torque_m2_nm": rng.normal(size=N_ROWS),
            "speed_rad_s": rng.normal(size=N_ROWS),
            "flags": np.zeros(N_ROWS, dtype=np.int64),
        },
        {"time_s": "s", "torque_m1_nm": "Nm", "torque_m2_nm": "Nm", "speed_rad_s": "rad/s", "flags": ""},
        {"rig": "bench"},
    )


@pytest.fixture
def changed(own_table: Table) -> Callable[..., Table]:
    """Return the recording with columns replaced, added, or (None) removed."""

    def change(**columns: np.ndarray | None) -> Table:
        merged = {**own_table.columns, **columns}
        return Table(own_table.path, {name: column for name, column in merged.items() if column is not None})

    return change
