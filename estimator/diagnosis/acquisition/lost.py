"""Lost samples: readings that are missing, flagged, or recorded as zero without a flag.

Rows that a mask of the model file takes out were read well; they are the choice of whoever wrote it. And where nothing
was read for long, the recording has a gap, which is no matter of single samples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.diagnosis.acquisition.finding import Finding, Sized
from estimator.diagnosis.acquisition.limits import SMALLEST_P, SMALLEST_SHARE
from estimator.diagnosis.acquisition.lost_zeros import lost_zeros
from estimator.diagnosis.acquisition.readings import all_of, any_of, mean_run, share_interval, shorter_runs
from estimator.signals.record import BoolArray, Record

LONGEST_BURST = 50
"""More missing rows than this in a row are a gap."""


def lost_samples(records: Sequence[Record]) -> Finding | None:
    """Recognise lost readings; None where they are too few to matter."""
    zeros, p_value = lost_zeros(records)
    missing = [_missing(record) for record in records]
    cells = [absent | zero for absent, zero in zip(missing, zeros, strict=True)]
    rows = [any_of(lost) for lost in cells]
    count, total = sum(int(lost.sum()) for lost in rows), sum(lost.size for lost in rows)
    if count < SMALLEST_SHARE * total:
        return None
    share = count / total
    silent = any(zero.any() for zero in zeros)
    how = (
        "recorded as zero without a flag"
        if silent and not any(lost.any() for lost in missing)
        else "missing or flagged"
    )
    return Finding(
        name="lost_samples",
        parameters={"share": Sized(share, share_interval(count, total, mean_run(rows)), "")},
        cells={record.name: lost for record, lost in zip(records, cells, strict=True)},
        p_value=max(p_value, SMALLEST_P) if silent else SMALLEST_P,
        statement=f"{100.0 * share:.2g}% of the samples were lost: their rows are {how}",
    )


def _missing(record: Record) -> BoolArray:
    """Return what the recording itself says is missing, gaps left out; shape (N, 1 + M)."""
    lost = ~record.torque_trusted
    whole_row = all_of(lost) & ~record.okay
    lost = np.column_stack([~np.isfinite(record.output) | whole_row, lost])
    short = shorter_runs(any_of(lost), LONGEST_BURST)
    missing: BoolArray = lost & short[:, np.newaxis]
    return missing
