"""A shaft element on a bench: its twist is imposed, the torque it carries is measured; there is no inertia.

Equation (translation: read N, m, N s/m)::

    T = k e f(e) + T_h z + c de/dt - T_0

``e`` is the twist; ``f`` belongs to ``stiffness_nonlinearity``, ``T_h z`` to ``shaft_hysteresis``, of which a joint
has Dahl's slider alone: n = u = 1, m = 0, whatever those are set to. The constant torque ``T_0`` and the twist at the
start are unknown in every recording.

``backlash`` is a gap in series with spring and slider: of the twist they get ``e``, and the gap takes the rest, at most
half of itself to either side. Faces only push: they touch on one side where the torque is positive, on the other where
it is negative; in between there is none, and no damping. Where the slider has moved, the gap has moved with it.
"""

from __future__ import annotations

import math

import numpy as np

from estimator.compiled import compiled
from estimator.physics.effects import backlash, stiffness_nonlinearity
from estimator.physics.kernel import slots, state_vector
from estimator.physics.laws import beyond_gap, share_inside
from estimator.physics.motion import measured_speed
from estimator.signals.record import FloatArray, Record

TORQUE = -1
"""The output that a joint has beside the kernel's states: the torque it carries."""

HALVINGS = 60
"""Of the range in which the balance inside an open gap lies: to the last bit."""


def simulate(
    record: Record,
    p: FloatArray,
    load_torque_nm: FloatArray,
    twist_rad: float,
    output: int = TORQUE,
) -> FloatArray:
    """Simulate the torque of a joint, or its motion, under the imposed motion of a recording.

    Parameters
    ----------
    p : ndarray, shape (layout.SIZE,)
        Parameters of the superset model.
    load_torque_nm : ndarray, shape (N,)
        Constant torque T_0, and what there is beside it [Nm].
    twist_rad : float
        Twist at the first sample [rad].
    output : int
        ``TORQUE``, or a state of the kernel; the far end is at rest.

    Returns
    -------
    ndarray, shape (N,)
        Torque [Nm], rad or rad/s.
    """
    imposed = _imposed(record)
    twist, rate = imposed - imposed[0] + twist_rad, _rate(record)
    motion: dict[int, FloatArray] = {
        state_vector.TWIST: twist,
        state_vector.SPEED: rate,
        state_vector.ANGLE: imposed - imposed[0],
    }
    if output != TORQUE:
        return motion[output] if output in motion else np.zeros(twist.shape)
    out: FloatArray = np.empty_like(twist)
    respond(record.since_start_s, record.sample_time_s, twist, rate, p, out)
    taken: FloatArray = out - load_torque_nm
    return taken


def _imposed(record: Record) -> FloatArray:
    if record.imposed is None:
        raise ValueError(f"recording {record.name}: a joint is simulated from an imposed motion, came none")
    return record.imposed


def _rate(record: Record) -> FloatArray:
    """Return the rate of the imposed motion at every sample; at the ends, that nearest to them."""
    slope = measured_speed(record)
    known = np.flatnonzero(np.isfinite(slope))
    rate: FloatArray = np.interp(np.arange(slope.size), known, slope[known])
    return rate


@compiled
def respond(
    time_s: FloatArray,
    period_s: float,
    twist: FloatArray,
    rate: FloatArray,
    p: FloatArray,
    out: FloatArray,
) -> None:
    """Fill ``out`` with the torque under an imposed twist [rad] and its rate [rad/s]; all of shape (N,)."""
    inside, loading = beyond_gap(twist[0], p[slots.GAP]), 0.0
    for k in range(twist.shape[0]):
        broken = share_inside(time_s[k], period_s, p[slots.CRACK_FROM], p[slots.CRACK_TO])
        stiffness = p[slots.K] * (1.0 + broken * p[slots.CRACK])
        before = inside
        inside = behind_gap(twist[k], before, loading, stiffness, p)
        loading = slid(loading, inside - before, p)
        share = 1.0
        if p[slots.GAP] > 0.0:
            moved = twist[k] - twist[k - 1] if k > 0 else 0.0
            share = min(max((inside - before) / moved, 0.0), 1.0) if moved != 0.0 else 0.0
            share *= backlash.damping_share(inside, p[slots.CONTACT])
        out[k] = carried(inside, loading, stiffness, p) + share * p[slots.C] * rate[k]


@compiled
def behind_gap(twist: float, before: float, loading: float, stiffness: float, p: FloatArray) -> float:
    """Return which part of a twist spring and slider get [rad].

    ``before`` and ``loading`` are their part and the slider's loading so far. On the way from there the torque only
    rises with their part, so that one of the three cases holds.
    """
    if p[slots.GAP] <= 0.0:
        return twist
    half = 0.5 * float(p[slots.GAP])
    low, high = twist - half, twist + half
    if carried(low, slid(loading, low - before, p), stiffness, p) >= 0.0:
        return low
    if carried(high, slid(loading, high - before, p), stiffness, p) <= 0.0:
        return high
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if carried(middle, slid(loading, middle - before, p), stiffness, p) < 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@compiled
def slid(loading: float, change: float, p: FloatArray) -> float:
    """Return a slider's loading after a change of its twist [rad]: Dahl's law, solved exactly."""
    if p[slots.SLIDER] == 0.0 or change == 0.0:
        return loading
    towards = math.copysign(1.0, change)
    return towards + (loading - towards) * math.exp(-abs(change) / float(p[slots.YIELD]))


@compiled
def carried(inside: float, loading: float, stiffness: float, p: FloatArray) -> float:
    """Return the torque of spring and slider [Nm]."""
    factor = stiffness_nonlinearity.factor(inside, p[slots.HARDENING], p[slots.SHAPE])
    return stiffness * inside * factor + float(p[slots.SLIDER]) * loading
