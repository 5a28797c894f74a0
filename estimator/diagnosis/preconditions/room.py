"""Whether recordings fit into memory: each has unknowns of its own, and a fit holds every sample for every unknown.

So a fit takes memory as the product of samples and recordings; a piece between two long gaps, and a stretch of a long
recording, counts as one. Of more than there is room for some are used, one from each part of the list; which one is
drawn, so that recordings whose kinds take turns are not all of one kind.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import sqrt

import numpy as np

from estimator.diagnosis.segments import Cut
from estimator.signals.record import Record

MOST = 500_000
"""Samples of all recordings, counted once for each recording: 12 of 3000 samples. A fit takes some 1.4 kB for each."""

SEED = 1


def with_room(segments: Cut, training: Iterable[str]) -> tuple[Cut, list[str]]:
    """Leave out pieces of the recordings that are fitted, as many as a fit can't hold; say which are used.

    Parameters
    ----------
    segments
        All recordings, cut.
    training
        Names of those that are fitted; others are only simulated, one by one.
    """
    pieces = segments.of(training)
    used = list(pieces)
    while (size := _size(used)) > MOST and len(used) > 1:
        used = _some(pieces, min(int(len(used) * sqrt(MOST / size)), len(used) - 1))
    if len(used) == len(pieces):
        return segments, []
    left_out = {piece.name for piece in pieces} - {piece.name for piece in used}
    kept = tuple(record for record in segments.records if record.name not in left_out)
    return replace(segments, records=kept), [_warning(used, pieces)]


def _size(pieces: Sequence[Record]) -> int:
    return len(pieces) * sum(int(piece.output.shape[0]) for piece in pieces)


def _some(pieces: Sequence[Record], count: int) -> list[Record]:
    """Return one of each of so many equal parts of the list, at least one in all."""
    edges = np.linspace(0, len(pieces), max(count, 1) + 1).astype(int)
    return [pieces[i] for i in np.random.default_rng(SEED).integers(edges[:-1], edges[1:])]


def _warning(used: Sequence[Record], pieces: Sequence[Record]) -> str:
    return (
        f"{len(used)} of {len(pieces)} recordings are used (each piece between long gaps, or stretch of a long one, "
        f"counts as one), drawn from the whole list: {', '.join(piece.name for piece in used)}. Each has unknowns of "
        "its own, so more would take gigabytes. Give those that matter, and the others by --holdout."
    )
