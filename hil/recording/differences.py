"""What one table has that another lacks: how a conversion tells what it lost."""

from __future__ import annotations

import numpy as np

from hil.recording.checksum import CHECKSUMS
from hil.recording.kinds import Column, Kind
from hil.recording.table import Table

_SHOWN = 40


def losses(before: Table, after: Table) -> list[str]:
    """Name what of `before` is not in `after`, one line each; empty where all of it is, bit for bit.

    NaN equals NaN, whatever its payload. Checksums are no content of their own and are not compared.
    """
    return [*_columns(before, after), *_units(before, after), *_metadata(before, after)]


def _columns(before: Table, after: Table) -> list[str]:
    lost = []
    for name, column in before.columns.items():
        if name not in after.columns:
            lost.append(f"column {name}: lost")
        elif problem := _cells(column, after.columns[name]):
            lost.append(f"column {name}: {problem}")
    if not lost and list(before.columns) != list(after.columns):
        lost.append("the order of the columns")
    return lost


def _cells(before: Column, after: Column) -> str:
    if before.shape != after.shape:
        return f"expected {before.size} cells, got {after.size}"
    kinds = Kind.of(before), Kind.of(after)
    changed = np.flatnonzero(~_same(before, after))
    if kinds[0] is not kinds[1]:
        return f"{kinds[0].value} becomes {kinds[1].value}"
    if changed.size:
        row = int(changed[0])
        shown = " becomes ".join(repr(column[row])[:_SHOWN] for column in (before, after))
        return f"{changed.size} of {before.size} cells change, the first in row {row + 1}: {shown}"
    return ""


def _same(before: Column, after: Column) -> Column:
    if before.dtype != after.dtype:
        return np.zeros(before.shape, dtype=np.bool_)
    if Kind.of(before) is Kind.FLOAT:
        same_bits = before.view(np.int64) == after.view(np.int64)  # tells 0.0 from -0.0
        return np.asarray(same_bits | (np.isnan(before) & np.isnan(after)))
    return np.asarray(before == after, dtype=np.bool_)


def _units(before: Table, after: Table) -> list[str]:
    return [
        f"unit of column {name}: {unit!r} becomes {after.units[name]!r}"
        if name in after.units
        else f"unit of column {name}: {unit!r} is lost"
        for name, unit in before.units.items()
        if name in before.columns and after.units.get(name) != unit
    ]


def _metadata(before: Table, after: Table) -> list[str]:
    return [
        f"metadata {key}: changed" if key in after.metadata else f"metadata {key}: lost"
        for key, value in before.metadata.items()
        if key not in CHECKSUMS and after.metadata.get(key) != value
    ]
