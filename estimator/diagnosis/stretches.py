"""Stretches of long recordings: what a diagnosis looks at, so that its time and memory are bounded.

Where all recordings together hold more than ``MOST_SAMPLES``, stretches evenly spread over them are used, each with its
own initial state and constant load torque; recordings shorter than one stay whole. A simulation over many minutes says
no more of a driveline than several over one minute each; what happens in between is not seen, and a warning says so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from estimator.signals.record import Record

LONGEST_S = 60.0
"""Length of a stretch at most: hundreds of periods of a driveline's first mode, and a dozen speed changes."""

MOST_SAMPLES = 30_000
"""Samples that are fitted, of all recordings together: five minutes at 10 ms. Every array of a fit is in proportion."""


def stretches(record: Record, parts: Sequence[slice], share: float) -> list[slice]:
    """Return the rows of a recording that are used, in order.

    Parameters
    ----------
    parts : sequence of slice
        Its segments.
    share : float
        Part of the samples that may be used, 1 or more for all.
    """
    if share >= 1.0:
        return list(parts)
    longest = max(round(LONGEST_S / record.sample_time_s), 1)
    return [piece for part in parts for piece in _pieces(part, longest, share)]


def share_of(records: Sequence[Record]) -> float:
    """Return which part of the samples of all recordings may be used."""
    return MOST_SAMPLES / sum(record.okay.size for record in records)


def _pieces(part: slice, longest: int, share: float) -> list[slice]:
    size = part.stop - part.start
    allowed = min(size, max(math.ceil(share * size), longest))
    count = math.ceil(allowed / longest)
    length = allowed // count
    starts = part.start + np.linspace(0, size - length, count).astype(int)
    return [slice(int(start), int(start) + length) for start in starts]
