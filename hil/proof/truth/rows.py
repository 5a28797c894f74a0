"""What becomes of the rows on their way to the file: wrong bits, repeats, losses, in this order."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.physics import FloatArray

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

FLAG_M1, FLAG_M2 = 1, 2
"""Quality flags of a row: an inverter did not answer. The speed comes from m1."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Columns of a recording, shape (N,) each; ``flags`` is None where the recorder has none to give."""

    torque_m1_nm: FloatArray
    torque_m2_nm: FloatArray
    speed_rad_s: FloatArray
    flags: IntArray | None = None


def as_recorded(rows: Rows, acquisition: Acquisition, rng: np.random.Generator) -> Rows:
    """Return the rows as the file has them; faultless ones come back as they are."""
    for step in (_spiked, _stale, _lost):
        rows = step(rows, acquisition, rng)
    return rows


def _spiked(rows: Rows, a: Acquisition, rng: np.random.Generator) -> Rows:
    if a.spike_share <= 0.0:
        return rows
    n = rows.speed_rad_s.size
    error = rng.uniform(0.3, 1.0, n) * rng.choice([-1.0, 1.0], n) * a.spike_rad_s
    return replace(rows, speed_rad_s=rows.speed_rad_s + np.where(rng.random(n) < a.spike_share, error, 0.0))


def _stale(rows: Rows, a: Acquisition, rng: np.random.Generator) -> Rows:
    n = rows.speed_rad_s.size
    if a.stale_every > 0:
        repeats = np.arange(n) % a.stale_every == a.stale_every - 1
    elif a.stale_share > 0.0:
        repeats = runs(n, a.stale_share, a.stale_most, rng)
    else:
        return rows
    fresh = np.maximum.accumulate(np.where(repeats, 0, np.arange(n)))
    if not a.stale_rows:
        return replace(rows, speed_rad_s=rows.speed_rad_s[fresh])
    return replace(
        rows,
        torque_m1_nm=rows.torque_m1_nm[fresh],
        torque_m2_nm=rows.torque_m2_nm[fresh],
        speed_rad_s=rows.speed_rad_s[fresh],
    )


def _lost(rows: Rows, a: Acquisition, rng: np.random.Generator) -> Rows:
    if a.lost_share <= 0.0:
        return rows
    lost = runs(rows.speed_rad_s.size, a.lost_share, a.lost_most, rng)
    blank = 0.0 if a.lost_as_zero else np.nan
    from_m1 = lost & (a.lost_m1 or a.lost_speed)
    flags = FLAG_M1 * from_m1.astype(np.int64) + FLAG_M2 * (lost & a.lost_m2).astype(np.int64)
    return Rows(
        torque_m1_nm=np.where(lost & a.lost_m1, blank, rows.torque_m1_nm),
        torque_m2_nm=np.where(lost & a.lost_m2, blank, rows.torque_m2_nm),
        speed_rad_s=np.where(lost & a.lost_speed, blank, rows.speed_rad_s),
        flags=None if a.lost_as_zero else flags,
    )


def runs(n: int, share: float, most: int, rng: np.random.Generator) -> BoolArray:
    """Return where runs of 1 to ``most`` samples are that begin at a share of the n samples; never at the first."""
    hit = np.zeros(n, dtype=np.bool_)
    for start in np.flatnonzero(rng.random(n) < share):
        hit[start : start + rng.integers(1, most + 1)] = True
    hit[0] = False
    return hit
