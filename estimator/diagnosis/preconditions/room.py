"""Whether recordings fit into memory: each has unknowns of its own, and a fit holds every sample for every unknown."""

from __future__ import annotations

from collections.abc import Sequence

from estimator.errors import BadShape
from estimator.signals.record import Record

MOST = 3_000_000
"""Samples of all recordings, counted once for each recording: 31 of 3000 samples. A fit takes some 1.4 kB for each."""


def require_room(records: Sequence[Record]) -> None:
    """Refuse more than a diagnosis can hold, before any room is made.

    Raises
    ------
    BadShape
        With how much came, and what to do.
    """
    samples = sum(record.output.shape[0] for record in records)
    if samples * len(records) > MOST:
        raise BadShape(
            f"{len(records)} recordings (at long gaps each piece is one) of {samples} samples in all: expected at most "
            f"{MOST} as their product, came {samples * len(records)}, which takes gigabytes. Give fewer recordings, or "
            "shorter ones."
        )
