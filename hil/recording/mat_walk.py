"""The variables of a .mat file, structs and cells taken apart: vectors by address, scalars, and the rest."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from hil.recording.address import vectors_of
from hil.recording.kinds import Column
from hil.recording.mat_tables import columns_of, is_table

DEEPEST: Final = 12
"""Structs inside structs that are looked into."""


def walk(
    name: str, value: Any, vectors: dict[str, Column], scalars: dict[str, str], other: list[str], depth: int = 0
) -> None:
    """Put what is in a variable where it belongs."""
    if is_table(value):
        fields = columns_of(value)
    elif hasattr(value, "_fieldnames"):
        fields = {field: getattr(value, field) for field in value._fieldnames}  # noqa: SLF001 - scipy's way to them
    elif isinstance(value, np.ndarray) and value.dtype.names is not None:
        fields = {field: value[field] for field in value.dtype.names}
    elif isinstance(value, dict):
        fields = value
    elif isinstance(value, np.ndarray) and value.dtype == object:
        parts = value.ravel(order="F").tolist()
        fields = {f"({k + 1})" if len(parts) > 1 else "": part for k, part in enumerate(parts)}
    else:
        _sort(name, np.asarray(value), vectors, scalars, other)
        return
    if depth >= DEEPEST or (isinstance(value, np.ndarray) and value.size > 64):
        other.append(name)
        return
    for key, part in fields.items():
        inside = name + key if not key or key.startswith("(") else f"{name}.{key}"
        walk(inside, part, vectors, scalars, other, depth + 1)


def _sort(name: str, array: Column, vectors: dict[str, Column], scalars: dict[str, str], other: list[str]) -> None:
    if array.dtype.kind in "fiub" and array.size == 1:
        scalars[name] = repr(array.item())
        return
    found = dict(vectors_of(name, array)) if array.dtype.kind in "fiub" else {}
    vectors.update(found)
    if not found:
        other.append(name)
