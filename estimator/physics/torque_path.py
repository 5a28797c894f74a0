"""From the inverters' readings to the torque on the motor shaft: gains, limits and derating, before delay and lag."""

from __future__ import annotations

import functools

import numpy as np

from estimator.physics.acting import Place
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.effects import torque_saturation
from estimator.physics.layout import slot
from estimator.signals.record import MOST_BYTES, FloatArray, Record, once

_GAIN_M1 = slot("inverter_gain_mismatch", "gain_m1")
_GAIN_M2 = slot("inverter_gain_mismatch", "gain_m2")
_LIMIT_M1 = slot("torque_saturation", "limit_m1_nm")
_LIMIT_M2 = slot("torque_saturation", "limit_m2_nm")
_SHARPNESS = slot("torque_saturation", "sharpness")
_LIMIT_SUM = slot("torque_saturation", "limit_sum_nm")
_DEPTH = slot("torque_derating", "depth")
_DERATING_TIME = slot("torque_derating", "time_constant_s")
_HEATED = slot("torque_derating", "heating_nm")
DECLARED = [
    (e.acting.law, [slot(e.name, each.name) for each in e.parameters], e.parameters[0].null)
    for e in BUILT_IN.values()
    if e.acting is not None and e.acting.place is Place.TORQUE
]
"""Laws of entries at this place, where their parameters are, and at which value of the first they do nothing."""

_WRITTEN = [_GAIN_M1, _GAIN_M2, _LIMIT_M1, _LIMIT_M2, _SHARPNESS, _LIMIT_SUM, _DEPTH, _DERATING_TIME, _HEATED]
_PATH = np.array([*_WRITTEN, *(place for _, places, _ in DECLARED for place in places)])
"""Where all stands that ``shaft_torque`` depends on."""


def limited(torque: FloatArray, limit: float, sharpness: float) -> FloatArray:
    """Return a torque that stops at a limit [Nm], at an edge or in a knee: ``T / (1 + |T/L|^n)^(1/n)``."""
    if not np.isfinite(limit):
        return torque
    if sharpness >= torque_saturation.EDGE:
        return np.clip(torque, -limit, limit)
    ratio = np.abs(torque) / limit
    small, large = np.minimum(ratio, 1.0), np.maximum(ratio, 1.0)
    size = np.where(
        ratio <= 1.0,
        small / (1.0 + small**sharpness) ** (1.0 / sharpness),
        (1.0 + large**-sharpness) ** (-1.0 / sharpness),
    )
    return np.asarray(np.copysign(limit * size, torque))


def warmth(torque: FloatArray, since_start_s: FloatArray, period_s: float, p: FloatArray, begun: float) -> FloatArray:
    """Return how warm the windings are when each row begins and behind the last, 1 with the full loss; shape (N + 1,).

    By time alone, or, where they are heated, by the torque's own losses: ``tau dh/dt + h = (T / T_n)^2``, held over
    each period; ``begun`` is the first row's then.
    """
    if p[_HEATED] <= 0.0:
        rows_and_end = np.append(since_start_s, since_start_s[-1] + period_s)
        return np.asarray(-np.expm1(-rows_and_end / p[_DERATING_TIME]))
    from scipy.signal import lfilter  # half a second that few need

    kept = float(np.exp(-period_s / p[_DERATING_TIME]))
    heat = (1.0 - kept) * (torque / p[_HEATED]) ** 2
    warm, _ = lfilter([1.0], [1.0, -kept], heat, zi=[kept * begun])
    return np.concatenate([[begun], warm])


def shaft_torque(torque_nm: FloatArray, since_start_s: FloatArray, p: FloatArray) -> FloatArray:
    """Return the torque on the motor shaft, shape (N,) [Nm], of a recording; see ``shaft_torque_from``."""
    period_s = float(since_start_s[1] - since_start_s[0]) if since_start_s.size > 1 else 0.0
    return shaft_torque_from(torque_nm, since_start_s, period_s, p, 0.0)[0]


def shaft_torque_from(
    torque_nm: FloatArray, since_start_s: FloatArray, period_s: float, p: FloatArray, begun: float
) -> tuple[FloatArray, float]:
    """Return the torque on the motor shaft, shape (N,) [Nm], and how warm the windings are behind it.

    Parameters
    ----------
    torque_nm : ndarray, shape (N, M)
        Reading of each input; gains other than 1 apply to the first two.
    since_start_s : ndarray, shape (N,)
        Time since the recording began [s].
    period_s : float
        For which each row's torque acts [s].
    p : ndarray, shape (layout.SIZE,)
        Parameters of the superset model.
    begun : float
        How warm the windings are at the first row, as ``warmth`` has it.
    """
    gains = np.array([p[_GAIN_M1], p[_GAIN_M2]])
    if (gains != 1.0).any():
        torque_nm = torque_nm.copy()
        count = min(torque_nm.shape[1], gains.size)
        torque_nm[:, :count] *= gains[:count]
    limits = np.array([p[_LIMIT_M1], p[_LIMIT_M2]])[: torque_nm.shape[1]]
    if np.isfinite(limits).any():
        columns = [limited(torque, limit, p[_SHARPNESS]) for torque, limit in zip(torque_nm.T, limits, strict=False)]
        torque_nm = np.column_stack([*columns, torque_nm[:, limits.size :]])
    total: FloatArray = limited(functools.reduce(np.add, torque_nm.T), p[_LIMIT_SUM], p[_SHARPNESS])
    for law, places, null in DECLARED:
        if p[places[0]] != null:
            total = law(total, since_start_s, *p[places])
    if p[_DEPTH] == 0.0:
        return total, 0.0
    warm = warmth(total, since_start_s, period_s, p, begun)
    return total * (1.0 - p[_DEPTH] * warm[:-1]), float(warm[-1])


class _Kept:
    """What the last torques of a recording were worked out from, and these: most simulations ask for one of them."""

    def __init__(self) -> None:
        self.torques: tuple[tuple[bytes, FloatArray], ...] = ()


MOST_KEPT = 2
"""Torques that are kept: that of a fit, and one with something moved."""


@once
def _kept(record: Record) -> _Kept:
    return _Kept()


def recorded_shaft_torque(record: Record, p: FloatArray) -> FloatArray:
    """Return ``shaft_torque`` of a recording, which nobody may write to."""
    kept, key = _kept(record), path_of(p)
    for known, torque in kept.torques:
        if known == key:
            return torque
    torque = shaft_torque(record.torque_nm, record.since_start_s, p)
    if torque.nbytes <= MOST_BYTES:
        kept.torques = ((key, torque), *kept.torques)[:MOST_KEPT]
    return torque


def path_of(p: FloatArray) -> bytes:
    """Return what the torque on the shaft depends on: of most lines it is the same."""
    path: FloatArray = p[_PATH]
    return path.tobytes()
