"""Repeats of one channel, over all recordings: how many, how many by chance, and whether the signal catches up.

After a stale reading the next change holds the motion of two periods. After an innocent repeat it is smaller than
usual: the signal repeated because it was slow, or lay on a lattice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from estimator.diagnosis.acquisition.lattice import chance_repeats, lattice_step, repeats
from estimator.diagnosis.acquisition.limits import LEVEL, SMALLEST_SHARE
from estimator.diagnosis.acquisition.readings import runs
from estimator.diagnosis.acquisition.telling import telling_rows
from estimator.signals.record import BoolArray, FloatArray

CATCH_UP = 0.8
"""Smallest ratio of the median change after a repeat to the usual one, for the repeats to be stale. Two periods of
motion give up to 2, of white noise 1; an innocent repeat in white noise gives sqrt(3)/2 = 0.87, one in a slow signal
on a lattice a small fraction."""


@dataclass(frozen=True, slots=True)
class Repeated:
    """What one channel's repeats say.

    Attributes
    ----------
    rows : tuple of ndarray of bool, shape (N,)
        Per recording, rows that repeat where a repeat tells.
    total : int
        Rows in which a repeat would tell.
    expected, upper : float
        Repeats by chance among these: best estimate, and the most it may be.
    catch_up : float
        Median change after a repeat, over the usual one; 0 without repeats.
    """

    rows: tuple[BoolArray, ...]
    total: int
    expected: float
    upper: float
    catch_up: float

    @property
    def count(self) -> int:
        """Repeats in telling rows."""
        return sum(int(rows.sum()) for rows in self.rows)

    @property
    def p_value(self) -> float:
        """Probability of as many repeats by chance: binomial, at the most that chance may do."""
        return float(stats.binom.sf(self.count - 1, self.total, self.upper / self.total)) if self.total else 1.0

    @property
    def is_stale(self) -> bool:
        """Whether they are beyond chance, enough to matter, and caught up with."""
        return self.share(self.count) >= SMALLEST_SHARE and self.p_value <= LEVEL and self.catch_up >= CATCH_UP

    def share(self, count: float) -> float:
        """Return the share of stale rows behind a count of repeats: those by chance taken off."""
        fresh = self.total - self.expected
        return max(count - self.expected, 0.0) / fresh if fresh > 0.0 else 0.0


def repeated(series: Sequence[FloatArray]) -> Repeated:
    """Look for repeats in one channel of a set of recordings; each array has shape (N,), NaN where nothing was read."""
    rows, after, usual = [], [], []
    total, expected, upper = 0, 0.0, 0.0
    for values in series:
        step = lattice_step(values)
        tells = telling_rows(values, step)
        again = repeats(values, step) & tells
        change = np.diff(values, prepend=np.nan)
        chance = chance_repeats(change[tells], step)
        rows.append(again)
        total, expected, upper = total + int(tells.sum()), expected + chance.expected, upper + chance.upper
        follows = _follows(again)
        after.append(np.abs(change[follows & np.isfinite(change)]))
        usual.append(np.abs(change[tells & ~again & ~follows]))
    return Repeated(tuple(rows), total, expected, upper, _ratio(np.concatenate(after), np.concatenate(usual)))


def _follows(again: BoolArray) -> BoolArray:
    """Return the rows right after runs of repeats, shape (N,)."""
    follows = np.zeros_like(again)
    for _, end in runs(again):
        if end < again.size:
            follows[end] = True
    return follows


def _ratio(after: FloatArray, usual: FloatArray) -> float:
    return float(np.median(after) / np.median(usual)) if after.size and usual.size else 0.0
