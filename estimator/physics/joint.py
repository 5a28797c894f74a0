"""The shaft by itself: a joint on a bench whose motion is imposed, and the twist of a shaft from measured speed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from estimator.compiled import compiled
from estimator.identification.modes.modes import Mode
from estimator.physics.curve import curve
from estimator.physics.effect import Around
from estimator.physics.effects.shaft import SHAFT_HYSTERESIS, damping_share, slider_law, slider_rate
from estimator.physics.kernel import slots, state_vector
from estimator.physics.kernel.laws_at import shaft_stiffness, spring_twist
from estimator.physics.laws import beyond_gap
from estimator.physics.layout import slot
from estimator.physics.model import DrivelineModel, Motion, Structure
from estimator.physics.motion import measured_speed
from estimator.signals.record import FloatArray, Record

TWIST = 2  # place of phi in the state [w_M, w_L, phi, T_L]

TORQUE = -1  # the output that a joint has next to the kernel's states: the torque it carries

SLIDER = tuple(slot(SHAFT_HYSTERESIS.name, each.name) for each in SHAFT_HYSTERESIS.parameters)  # places of its law's

PART_OF_TORQUE, MOST_SECANTS = 1e-12, 100
"""How near the balance inside an open gap is found, as part of the torques at its ends, and by how many secants."""

PART_OF_YIELD = 0.5
"""Longest step over a slider's twist, in multiples of that over which it yields and its sharpness: errors near 1e-4."""

FARTHEST = 100.0
"""Beyond so many times the twist over which it yields a slider has forgotten where it came from."""


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """How far signals and model are trusted; the first two are the bus's own figures (docs/formats.md)."""

    speed_rad_s: float = 0.05  # standard deviation of the speed reading [rad/s]
    torque_nm: float = 1.0  # standard deviation of the torque over one period, beyond its reading [Nm]
    load_nm_per_sqrt_s: float = 50.0  # how fast the load torque walks


@dataclass(frozen=True, slots=True)
class Shaft:
    """The numbers of a two-mass model, at the motor shaft: kg m^2, Nm/rad, Nm s/rad; and where they are from."""

    J_M: float  # inertia of the motor [kg m^2]
    J_L: float  # of the load [kg m^2]
    k: float  # stiffness [Nm/rad]
    c: float  # damping [Nm s/rad]
    b_M: float  # viscous friction at the motor [Nm s/rad]
    b_L: float  # at the load [Nm s/rad]
    source: str  # file that they are from

    @classmethod
    def of_model(cls, model: DrivelineModel, source: str) -> Shaft | None:
        """Take the numbers of a model of two rotating masses; None for any other."""
        if model.structure is not Structure.TWO_MASS or model.motion is not Motion.ROTATION:
            return None
        values = model.values()
        return cls(**{name: float(values[name]) for name in model.structure.parameter_names}, source=source)

    def with_resonance(self, mode: Mode) -> Shaft:
        """Return a shaft between two free inertias with this resonance, friction left out.

        With J = J_M J_L / (J_M + J_L): k = J w^2 and c = 2 J zeta w, w the natural frequency [rad/s].
        """
        inertia = self.J_M * self.J_L / (self.J_M + self.J_L)
        w = 2.0 * math.pi * mode.frequency_hz
        return replace(self, k=inertia * w * w, c=2.0 * inertia * mode.damping * w, source="resonance")


class TwistFilter:
    """The filter with its state."""

    def __init__(self, shaft: Shaft, period_s: float, uncertainty: Uncertainty | None = None) -> None:
        self._period_s = period_s
        self._uncertainty = uncertainty or Uncertainty()
        self._x: FloatArray = np.zeros(4)
        self._begun = False
        self._torque_nm = 0.0
        self.use(shaft)

    def use(self, shaft: Shaft) -> None:
        """Continue with other numbers, from the present state."""
        from scipy.linalg import solve_discrete_are  # a second to import, and a simulated rig filters nothing

        self.shaft = shaft
        self._F, self._g = _discrete(shaft, self._period_s)
        u = self._uncertainty
        Q = np.outer(self._g, self._g) * u.torque_nm**2
        Q[3, 3] += u.load_nm_per_sqrt_s**2 * self._period_s
        h = np.array([[1.0, 0.0, 0.0, 0.0]])
        P = solve_discrete_are(self._F.T, h.T, Q, np.array([[u.speed_rad_s**2]]))
        gain = P[:, 0] / (P[0, 0] + u.speed_rad_s**2)
        self._gain: FloatArray = np.asarray(gain, dtype=np.float64)
        self.twist_std_rad = math.sqrt(max(0.0, float(P[TWIST, TWIST] - gain[TWIST] * P[0, TWIST])))

    def step(self, torque_nm: float, speed_rad_s: float, okay: bool) -> float:
        """Take one sample."""
        if okay:
            if not self._begun:
                self._begun = True
                self._x[:2] = speed_rad_s
            self._x = self._x + self._gain * (speed_rad_s - self._x[0])
            self._torque_nm = torque_nm
        twist_rad = float(self._x[TWIST]) if self._begun else math.nan
        if self._begun:
            self._x = self._F @ self._x + self._g * self._torque_nm
        return twist_rad


def _discrete(shaft: Shaft, period_s: float) -> tuple[FloatArray, FloatArray]:
    """Return F, shape (4, 4), and g, shape (4,), for a torque held over one period."""
    from scipy.linalg import expm  # see above

    s = shaft
    A = np.zeros((5, 5))
    A[0, :3] = -(s.b_M + s.c) / s.J_M, s.c / s.J_M, -s.k / s.J_M
    A[1, :4] = s.c / s.J_L, -(s.b_L + s.c) / s.J_L, s.k / s.J_L, -1.0 / s.J_L
    A[2, :2] = 1.0, -1.0
    A[0, 4] = 1.0 / s.J_M
    moved = expm(A * period_s)
    return np.asarray(moved[:4, :4], dtype=np.float64), np.asarray(moved[:4, 4], dtype=np.float64)


class Imposed(NamedTuple):
    """The imposed motion of a recording at every sample: its twist since the first one [rad], its rate [rad/s]."""

    twist: FloatArray  # (N,) [rad]
    rate: FloatArray  # (N,) [rad/s]


def imposed_in(record: Record) -> Imposed:
    """Return the imposed motion of a recording of a joint."""
    if record.imposed is None:
        raise ValueError(f"recording {record.name}: a joint is simulated from an imposed motion, got none")
    return Imposed(record.imposed - record.imposed[0], _rate(record))


def simulate(
    record: Record,
    imposed: Imposed,
    p: FloatArray,
    load_torque_nm: FloatArray,
    twist_rad: float,
    preload_nm: float,
    output: int = TORQUE,
) -> FloatArray:
    """Simulate a joint under an imposed motion: its output at every sample, shape (N,)."""
    twist, rate = imposed.twist + twist_rad, imposed.rate
    motion: dict[int, FloatArray] = {
        state_vector.TWIST: twist,
        state_vector.SPEED: rate,
        state_vector.ANGLE: imposed.twist,
    }
    if output != TORQUE:
        return motion[output] if output in motion else np.zeros(twist.shape)
    out: FloatArray = np.empty_like(twist)
    respond(record.since_start_s, record.sample_time_s, twist, rate, preload_nm, p, out)
    return out - load_torque_nm


def _rate(record: Record) -> FloatArray:
    """Return the rate of the imposed motion at every sample; at the ends, that nearest to them."""
    slope = measured_speed(record)
    known = np.flatnonzero(np.isfinite(slope))
    return np.interp(np.arange(slope.size), known, slope[known])


@compiled
def respond(
    time_s: FloatArray,
    period_s: float,
    twist: FloatArray,
    rate: FloatArray,
    preload: float,
    p: FloatArray,
    out: FloatArray,
) -> None:
    """Fill ``out`` with the torque under an imposed twist [rad] and its rate [rad/s]; all of shape (N,)."""
    inside, loading = beyond_gap(twist[0], p[slots.GAP]), 0.0
    for k in range(twist.shape[0]):
        stiffness = shaft_stiffness(p[slots.K], time_s[k], period_s, p)
        before = inside
        inside = behind_gap(twist[k], before, loading, stiffness, preload, p)
        loading = slid(loading, inside - before, p)
        share = 1.0
        if p[slots.GAP] > 0.0:
            moved = twist[k] - twist[k - 1] if k > 0 else 0.0
            share = min(max((inside - before) / moved, 0.0), 1.0) if moved != 0.0 else 0.0
            share *= damping_share(inside, p[slots.CONTACT])
            share += p[slots.ACROSS] * (1.0 - share)
        damping = p[slots.C]
        if p[slots.TABLE_TWIST] > 0.0:
            slope = curve(inside, p, slots.TABLE_TWIST, False)[1]
            damping = damping * max(1.0 + slope / p[slots.K], 0.0) + p[slots.TABLE_DAMPING]
        out[k] = carried(inside, loading, stiffness, preload, p) + share * damping * rate[k]
        if p[slots.TABLE_RATE] > 0.0:
            out[k] += curve(rate[k], p, slots.TABLE_RATE, False)[0]


@compiled
def behind_gap(twist: float, before: float, loading: float, stiffness: float, preload: float, p: FloatArray) -> float:
    """Return which part of a twist spring and slider get [rad].

    ``before`` and ``loading`` are their part and the slider's loading so far. The torque only rises with their part: it
    stays as it is as far as the faces let it, or goes to where the torque is none, or to where a face holds it.
    """
    half = 0.5 * float(p[slots.GAP])
    if half <= 0.0:
        return twist
    start = min(max(before, twist - half), twist + half)
    at_start = carried(start, slid(loading, start - before, p), stiffness, preload, p)
    end = twist - half if at_start > 0.0 else twist + half
    at_end = carried(end, slid(loading, end - before, p), stiffness, preload, p)
    if at_start == 0.0 or start == end:
        return start
    if at_start * at_end >= 0.0:
        return end
    least = PART_OF_TORQUE * abs(at_end - at_start)
    middle = start
    for _ in range(MOST_SECANTS):  # false position after Illinois
        middle = end - at_end * (end - start) / (at_end - at_start)
        torque = carried(middle, slid(loading, middle - before, p), stiffness, preload, p)
        if abs(torque) <= least:
            break
        if torque * at_end < 0.0:
            start, at_start = end, at_end
        else:
            at_start *= 0.5
        end, at_end = middle, torque
    return middle


@compiled
def slider(p: FloatArray) -> tuple[float, float, float, float, float]:
    """Return the parameters of the slider inside the shaft, in the order of its law."""
    return p[SLIDER[0]], p[SLIDER[1]], p[SLIDER[2]], p[SLIDER[3]], p[SLIDER[4]]


@compiled
def slid(loading: float, change: float, p: FloatArray) -> float:
    """Return a slider's loading after a change of its twist [rad], however fast: Runge-Kutta steps over the twist."""
    if p[SLIDER[0]] == 0.0 or change == 0.0:
        return loading
    law, around = slider(p), Around(0.0, math.inf, math.inf)
    towards = math.copysign(law[1], change)  # the twist over which it yields, in a unit of time
    way = min(abs(change) / law[1], FARTHEST)
    steps = math.ceil(way * max(law[2], 1.0) / PART_OF_YIELD)
    h = way / steps
    for _ in range(steps):
        first = slider_rate(0.0, towards, loading, around, *law)
        second = slider_rate(0.0, towards, loading + 0.5 * h * first, around, *law)
        third = slider_rate(0.0, towards, loading + 0.5 * h * second, around, *law)
        fourth = slider_rate(0.0, towards, loading + h * third, around, *law)
        loading += h * (first + 2.0 * second + 2.0 * third + fourth) / 6.0
    return loading


@compiled
def carried(inside: float, loading: float, stiffness: float, preload: float, p: FloatArray) -> float:
    """Return the torque of spring and slider, less the preload [Nm]."""
    if p[slots.TABLE_TWIST] > 0.0:
        preload = preload - curve(inside, p, slots.TABLE_TWIST, False)[0]
    held = slider_law(inside, 0.0, loading, Around(stiffness, math.inf, math.inf), *slider(p))
    return stiffness * spring_twist(inside, p) + held - preload
