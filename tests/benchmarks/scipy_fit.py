"""The fit of a two-mass line as scipy alone does it: ``least_squares`` around ``solve_ivp``.

What is fitted, from where and within which bounds is taken from the project's own problem, so that both fits have the
same minimum. Everything else is scipy's. A torque that is held for a period has a step at its end, where an adaptive
step fails and is cut again and again; so ``solve_ivp`` is called once for every period, which is exact in the hold and,
of RK23, RK45, DOP853 and LSODA over the whole recording or by periods, took least time for an output error of a few
1e-4 rad/s.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import least_squares

from estimator.physics.driveline import Start
from estimator.physics.layout import slot
from estimator.physics.least_squares import CONVERGED
from estimator.physics.model import Structure
from estimator.physics.problem import Problem, bounds, local_part, parameters, residual_at, start_of, start_vector
from estimator.signals.record import FloatArray, Record

METHOD: Final = "RK45"
RELATIVE, ABSOLUTE = 1e-4, 1e-3
"""Tolerances that one step of a 10 ms period meets: the error of the output is then about the project's own."""

Values = Mapping[str, float]


def by_solve_ivp(values: Values, record: Record, start: Start) -> FloatArray:
    """Simulate the motor speed of a two-mass line from the recorded torque with ``solve_ivp``, shape (N,) [rad/s]."""
    J_M, J_L, k, c, b_M, b_L = (values[name] for name in Structure.TWO_MASS.parameter_names)
    load_nm = start.load_torque_nm

    def rates(_t: float, state: FloatArray, torque_nm: float) -> tuple[float, float, float]:
        speed, twist, load_speed = state.tolist()  # plain numbers: three of them are faster than an array
        shaft_nm = k * twist + c * (speed - load_speed)
        return (
            (torque_nm - b_M * speed - shaft_nm) / J_M,
            speed - load_speed,
            (shaft_nm - b_L * load_speed - load_nm) / J_L,
        )

    period_s = record.sample_time_s
    state = np.array([start.speed_rad_s, start.twist_rad, start.load_speed_rad_s])
    speed = np.empty_like(record.output)
    for row, torque_nm in enumerate(record.total_torque_nm.tolist()):
        speed[row] = state[0]
        solution = solve_ivp(
            rates,
            (0.0, period_s),
            state,
            METHOD,
            args=(torque_nm,),
            rtol=RELATIVE,
            atol=ABSOLUTE,
            first_step=period_s,
        )
        state = solution.y[:, -1]
    return speed


def exact(values: Values, record: Record, start: Start) -> FloatArray:
    """Return the motor speed of the same line without any error of integration, shape (N,) [rad/s].

    The line is linear and the torque is held: its state at the end of a period is a matrix exponential away.
    """
    J_M, J_L, k, c, b_M, b_L = (values[name] for name in Structure.TWO_MASS.parameter_names)
    whole = np.zeros((5, 5))
    whole[0] = np.array([-(b_M + c), -k, c, 1.0, 0.0]) / J_M
    whole[1] = [1.0, 0.0, -1.0, 0.0, 0.0]
    whole[2] = np.array([c, k, -(b_L + c), 0.0, -1.0]) / J_L
    step = expm(whole * record.sample_time_s)[:3]
    state = np.array([start.speed_rad_s, start.twist_rad, start.load_speed_rad_s])
    speed = np.empty_like(record.output)
    for row, torque_nm in enumerate(record.total_torque_nm.tolist()):
        speed[row] = state[0]
        state = step @ np.array([*state, torque_nm, start.load_torque_nm])
    return speed


@dataclass(frozen=True, slots=True)
class ScipyFit:
    """Where ``least_squares`` ended: scaled unknowns (U,), sum of squared errors, evaluations and Jacobians."""

    x: FloatArray
    squares: float
    evaluations: int
    jacobians: int


@dataclass
class _Simulations:
    """The simulation of each recording, kept while its unknowns stay: a difference step moves few recordings."""

    problem: Problem
    _known: dict[int, tuple[bytes, FloatArray]] = field(default_factory=dict)

    def residual(self, x: FloatArray) -> FloatArray:
        """Return simulated less measured speed at scaled unknowns, stacked."""
        return residual_at(self.problem, [self._output(x, i) for i in range(len(self.problem.records))])

    def _output(self, x: FloatArray, index: int) -> FloatArray:
        p = parameters(self.problem, x)
        values = {name: float(p[slot("", name)]) for name in Structure.TWO_MASS.parameter_names}
        key = np.array([*values.values(), *local_part(self.problem, x, index)]).tobytes()
        if index not in self._known or self._known[index][0] != key:
            start = start_of(self.problem, x, index)
            self._known[index] = key, by_solve_ivp(values, self.problem.records[index], start)
        return self._known[index][1]


def fit_by_scipy(problem: Problem) -> ScipyFit:
    """Minimise the squared free-run error with ``least_squares``: trust region, differences of two points.

    It ends where the project's own fit does, when a step changes the log-likelihood ratio by less than ``CONVERGED``.
    """
    simulations = _Simulations(problem)
    counted = sum(int(use.sum()) for use in problem.use)
    solution = least_squares(
        simulations.residual,
        start_vector(problem),
        "2-point",
        bounds(problem),
        method="trf",
        ftol=CONVERGED / counted,
        xtol=None,
        gtol=None,
    )
    return ScipyFit(solution.x, 2.0 * float(solution.cost), int(solution.nfev), int(solution.njev or 0))
