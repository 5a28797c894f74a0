"""Blocks of a held-out recording that count while the rest of it tells its own course (a road's grade, a load).

A block must have something measured on both sides, or nothing would tell the course in it. So blocks lie within
stretches that are long enough, away from their ends, and not next to a gap.
"""

from __future__ import annotations

import numpy as np

from estimator.diagnosis.inference.figures import BLOCK_S, EVERY_S
from estimator.diagnosis.segments import FEWEST_SAMPLES, SHORTEST_S, segments
from estimator.signals.record import BoolArray, Record

MARGIN_S = 0.5 * (EVERY_S - BLOCK_S)
"""Left on both sides of a block."""


def inner_blocks(record: Record) -> BoolArray:
    """Return the samples that are hidden and judged, shape (N,).

    0.6 s every 2 s of each stretch that a diagnosis would use, with 0.7 s of good samples on both sides.
    """
    hidden = np.zeros(record.okay.size, dtype=np.bool_)
    shortest = max(FEWEST_SAMPLES, round(SHORTEST_S / record.sample_time_s))
    period, block, margin = (round(time_s / record.sample_time_s) for time_s in (EVERY_S, BLOCK_S, MARGIN_S))
    for part in segments(record):
        if int(record.okay[part].sum()) >= shortest:
            for first in range(part.start + margin, part.stop - margin - block + 1, period):
                end = first + block
                hidden[first:end] = record.okay[first - margin : first].all() and record.okay[end : end + margin].all()
    return hidden & record.okay
