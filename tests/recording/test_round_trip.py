"""CSV to Parquet and back loses not one bit of a number."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.recording import Table, read_table, write_table

floats = st.floats(allow_nan=True, allow_infinity=True, width=64)
integers = st.integers(min_value=-(2**63), max_value=2**63 - 1)
names = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), min_size=1, max_size=12)


@st.composite
def tables(draw: st.DrawFn) -> Table:
    n = draw(st.integers(1, 12))
    columns = {}
    for name in draw(st.lists(names, min_size=1, max_size=5, unique=True)):
        if draw(st.booleans()):
            columns[name] = np.array(draw(st.lists(floats, min_size=n, max_size=n)), dtype=np.float64)
        else:
            columns[name] = np.array(draw(st.lists(integers, min_size=n, max_size=n)), dtype=np.int64)
    return Table(Path("a.csv"), columns)


def bits(table: Table) -> dict[str, tuple[str, list[int]]]:
    """Every cell's bits; all NaN are one, for the sign and payload of a NaN mean nothing."""
    out = {}
    for name, column in table.columns.items():
        plain = np.where(np.isnan(column), np.nan, column) if column.dtype == np.float64 else column
        out[name] = (str(column.dtype), plain.view(np.int64).tolist())
    return out


@given(tables())
@settings(max_examples=150, deadline=None)
def test_csv_to_parquet_and_back_keeps_every_bit(table: Table) -> None:
    with tempfile.TemporaryDirectory() as folder:
        first, second, third = (Path(folder) / name for name in ("a.csv", "b.parquet", "c.csv"))
        write_table(table, first)
        write_table(read_table(first), second)
        write_table(read_table(second), third)
        assert bits(read_table(second)) == bits(table)
        assert first.read_bytes() == third.read_bytes()
