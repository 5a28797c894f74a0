"""The driveline written down once more from the laws' texts and solved by scipy, to judge the compiled kernel.

Nothing of ``estimator`` is used here but the records. The torque is held over each period; the solver is restarted
wherever it or a law jumps, so that its own tolerance holds throughout.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from estimator.signals.record import FloatArray

Rhs = Callable[[float, FloatArray, float], FloatArray]
"""Time [s], state and torque on the shaft [Nm] to the state's derivative."""

ANGLE, SPEED, TWIST, LOAD_SPEED = range(4)
"""States of every two-mass line here; more may follow."""


@dataclass(frozen=True, slots=True)
class Held:
    """A torque that keeps ``values[i]`` from ``since_s[i]`` on, and ``values[0]`` before."""

    values: FloatArray
    since_s: FloatArray

    @classmethod
    def of(cls, torque_nm: FloatArray, period_s: float, late_s: float = 0.0, pace: float = 1.0) -> Held:
        """Hold a sampled torque; ``late_s`` shifts it, ``pace`` is how fast its clock runs."""
        return cls(torque_nm, (np.arange(torque_nm.size) * period_s + late_s) / pace)

    def at(self, time_s: float) -> float:
        """Return the torque at a time."""
        return float(self.values[max(int(np.searchsorted(self.since_s, time_s, side="right")) - 1, 0)])

    @property
    def jumps_s(self) -> FloatArray:
        """When it jumps."""
        return self.since_s[1:][np.diff(self.values) != 0.0]


def solve(rhs: Rhs, start: FloatArray, held: Held, times_s: FloatArray, events_s: Iterable[float] = ()) -> FloatArray:
    """Integrate from ``times_s[0]`` on; return the states at ``times_s``, shape (N, S)."""
    first, last = float(times_s[0]), float(times_s[-1])
    inner = {float(t) for t in (*held.jumps_s, *events_s) if first < t < last}
    edges = [first, *sorted(inner), last]
    states = np.empty((times_s.size, start.size))
    states[0], x = start, start
    for low, high in pairwise(edges):
        inside = (times_s > low) & (times_s <= high)
        torque = held.at(0.5 * (low + high))
        solution = solve_ivp(
            lambda t, y, torque=torque: rhs(t, y, torque),
            (low, high),
            x,
            method="DOP853",
            dense_output=True,
            rtol=1e-9,
            atol=1e-11,
        )
        assert solution.success, solution.message
        states[inside], x = solution.sol(times_s[inside]).T, solution.y[:, -1]
    return states


@dataclass(frozen=True, slots=True)
class TwoMass:
    """Newton's law for two masses and a shaft; each torque is a function that a test replaces by an effect's law."""

    values: Mapping[str, float]
    load_nm: float = 0.0
    ripple: Callable[[float], float] = field(default=lambda t: 0.0)
    friction: Callable[[float, float], float] = field(default=lambda t, w: 0.0)
    shaft: Callable[[float, float, float], float] | None = None
    drag: Callable[[float, float], float] = field(default=lambda t, w: 0.0)
    more_motor: Callable[[float], float] = field(default=lambda t: 0.0)
    more_load: Callable[[float], float] = field(default=lambda t: 0.0)

    def __call__(self, t: float, x: FloatArray, torque: float) -> FloatArray:
        """Return the derivative of (angle, speed, twist, load speed)."""
        v = self.values
        _, w_M, twist, w_L = x
        rate = w_M - w_L
        T_S = v["k"] * twist + v["c"] * rate if self.shaft is None else self.shaft(t, twist, rate)
        motor = torque + self.ripple(t) - v["b_M"] * w_M - self.friction(t, w_M) - T_S
        load = T_S - v["b_L"] * w_L - self.drag(t, w_L) - self.load_nm
        return np.array([w_M, motor / (v["J_M"] + self.more_motor(t)), rate, load / (v["J_L"] + self.more_load(t))])


def lasting(value: float, from_s: float, to_s: float) -> Callable[[float], float]:
    """Return a quantity that is there from one moment to another."""
    return lambda t: value if from_s <= t < to_s else 0.0
