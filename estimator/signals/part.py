"""A part of a recording."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from estimator.signals.record import Record


def sliced(record: Record, rows: slice, name: str | None = None) -> Record:
    """Return a part of a recording as a recording of its own; laws over time count from where the whole began."""
    parts: dict[str, Any] = {
        field.name: values[rows]
        for field in fields(record)
        if isinstance(values := getattr(record, field.name), np.ndarray)  # each has a row per sample
    }
    channels = tuple(replace(each, output=each.output[rows], okay=each.okay[rows]) for each in record.channels)
    began_s = float(record.time_s[0]) if record.began_s is None else record.began_s
    return replace(record, name=record.name if name is None else name, began_s=began_s, channels=channels, **parts)
