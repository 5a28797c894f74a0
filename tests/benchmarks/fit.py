"""Fit and simulation of a linear line next to scipy: ``python -m tests.benchmarks.fit [--pairs N]``."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from estimator.least_squares import CONVERGED
from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import FitResult, fit
from estimator.physics.layout import slot
from estimator.physics.model import Structure
from estimator.physics.problem import (
    Problem,
    bounds,
    local_part,
    make_problem,
    parameters,
    residual_at,
    start_of,
    start_vector,
)
from estimator.physics.simulate import simulate
from estimator.physics.unknowns import nominal_unknowns
from estimator.signals.record import FloatArray, Record
from tests.benchmarks.cases import NOTHING, Case, make
from tests.benchmarks.ratios import COLUMNS, Comparison, Taken, compare, machine, table

METHOD: Final = "RK45"
RELATIVE, ABSOLUTE = 1e-4, 1e-3
"""Tolerances that one step of a 10 ms period meets: the error of the output is then about the project's own."""

Values = Mapping[str, float]


def by_solve_ivp(values: Values, record: Record, start: InitialCondition) -> FloatArray:
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
            rates, (0.0, period_s), state, METHOD, args=(torque_nm,), rtol=RELATIVE, atol=ABSOLUTE, first_step=period_s
        )
        state = solution.y[:, -1]
    return speed


def exact(values: Values, record: Record, start: InitialCondition) -> FloatArray:
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


SEED = 1
PAIRS = 3
SIMULATIONS = 20
"""Simulations of ours that are timed as one: a single one is too short for a clock."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """How far two fits of one problem ended apart."""

    squares: float
    parameters: float
    likelihood: float
    sigmas: float


def problem_of(case: Case) -> Problem:
    """Set up the fit of the line's parameters to all recordings of a case."""
    return make_problem(case.model, case.records, nominal_unknowns(case.model))


def agreement(ours: FitResult, theirs: ScipyFit) -> Agreement:
    """Hold two fits of one problem against each other."""
    line = slice(0, len(ours.problem.shared))
    squares = abs(theirs.squares / ours.squares - 1.0)
    covariance = ours.rms**2 * np.linalg.inv(ours.jacobian.T @ ours.jacobian)
    step = np.abs(theirs.x - ours.x)
    return Agreement(
        squares=squares,
        parameters=float((step / ours.x)[line].max()),
        likelihood=ours.residual.size * squares,
        sigmas=float((step / np.sqrt(np.diag(covariance)))[line].max()),
    )


def compare_fits(problem: Problem, pairs: int) -> Comparison:
    """Fit a problem here and by scipy, in turn."""
    fit(problem)  # compiles, or reads what was compiled
    return compare(lambda: fit(problem), lambda: fit_by_scipy(problem), pairs)


@dataclass(frozen=True, slots=True)
class Simulated:
    """One simulation here and by ``solve_ivp``: times, and the RMS error of each against the exact one [rad/s]."""

    times: Comparison
    our_error: float
    their_error: float


def compare_simulations(problem: Problem, pairs: int) -> Simulated:
    """Simulate the first recording of a problem at its start, here and by ``solve_ivp``, in turn."""
    record, start, p = problem.records[0], start_of(problem, start_vector(problem), 0), problem.p
    values = {name: float(p[slot("", name)]) for name in Structure.TWO_MASS.parameter_names}

    def here() -> FloatArray:
        for _ in range(SIMULATIONS):
            output = simulate(problem.grid, record, p, start)
        return output

    here()  # compiles, or reads what was compiled
    times = compare(here, lambda: by_solve_ivp(values, record, start), pairs)
    single = tuple(Taken(each.clock_s / SIMULATIONS, each.processor_s / SIMULATIONS) for each in times.ours)
    truth = exact(values, record, start)
    ours, theirs = (float(np.sqrt(np.mean((each - truth) ** 2))) for each in (times.our_result, times.their_result))
    return Simulated(replace(times, ours=single), ours, theirs)


def report(case: Case, pairs: int) -> str:
    """Return the comparison of a case as Markdown."""
    problem = problem_of(case)
    with threadpool_limits(1, user_api="blas"):  # as in a diagnosis; scipy's fit loses nothing by it
        fits = compare_fits(problem, pairs)
        simulated = compare_simulations(problem, pairs)
    ours, theirs = fits.our_result, fits.their_result
    apart = agreement(ours, theirs)
    rows = [fits.row("fit of the line to all recordings"), simulated.times.row("simulation of one recording")]
    lengths_s = ", ".join(f"{r.time_s.size * r.sample_time_s:g}" for r in case.records)
    return (
        f"Recordings of {lengths_s} s at {1e3 * case.records[0].sample_time_s:g} ms; {ours.x.size} unknowns; "
        f"{pairs} pairs. {machine()}\n"
        + table(COLUMNS, rows)
        + f"\nMinima: sums of squares {apart.squares:.1e} apart, parameters {apart.parameters:.1e} "
        f"({apart.sigmas:.2g} standard errors); "
        f"scipy took {theirs.evaluations} steps and {theirs.jacobians} Jacobians. Error of integration (RMS): "
        f"{simulated.our_error:.1e} rad/s here, {simulated.their_error:.1e} rad/s scipy.\n"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare and write the report; return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.fit", description="One fit and one simulation, here and by scipy, as ratios."
    )
    parser.add_argument("--pairs", type=int, default=PAIRS, help="times each is done (default: %(default)s)")
    options = parser.parse_args(arguments)
    sys.stdout.write(report(make(NOTHING, SEED), options.pairs))
    return 0


if __name__ == "__main__":
    sys.exit(main())
