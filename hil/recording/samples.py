"""Samples of a rig as the columns of a recording."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from hil.recording import columns
from hil.recording.table import Table
from hil.sample import Sample


def cells_of(sample: Sample) -> tuple[float | int, ...]:
    """Return one sample in the order of ``columns.UNITS``, then its channels; the flags alone are an integer."""
    return (
        float(sample.time_s),
        float(sample.torque_ref_nm),
        float(sample.torque_m1_nm),
        float(sample.torque_m2_nm),
        float(sample.speed_rad_s),
        float(sample.prbs_nm),
        int(sample.flags),
        float(sample.torque_ref_m1_nm),
        float(sample.torque_ref_m2_nm),
        sample.age_ns / 1e9,
        *map(float, sample.channels),
    )


def table_of(
    samples: Iterable[Sample], path: Path, metadata: Mapping[str, str], channel_units: Mapping[str, str] | None = None
) -> Table:
    """Make a table of samples, a row each, with a column of each channel of theirs."""
    rows = [cells_of(sample) for sample in samples]
    units = {**columns.UNITS, **(channel_units or {})}
    kinds = {name: np.int64 if name == columns.FLAGS else np.float64 for name in units}
    cells = zip(*rows, strict=True) if rows else [() for _ in kinds]
    return Table(
        path,
        {name: np.array(column, dtype=kind) for (name, kind), column in zip(kinds.items(), cells, strict=True)},
        units,
        metadata,
    )
