"""``python -m tests.benchmarks.fit``: the fit of three 30 s recordings, and its simulation, next to scipy's.

Both fits have the same unknowns (six parameters, load torque and initial state of each recording), the same bounds, the
same start and the same end; they must reach the same minimum.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.physics.fit import FitResult, fit
from estimator.physics.layout import slot
from estimator.physics.model import Structure
from estimator.physics.problem import Problem, make_problem, start_of, start_vector
from estimator.physics.simulate import simulate
from estimator.physics.unknowns import nominal_unknowns
from estimator.signals.record import FloatArray
from tests.benchmarks.cases import NOTHING, Case, make
from tests.benchmarks.ratios import COLUMNS, Comparison, Taken, compare, machine, table
from tests.benchmarks.scipy_fit import ScipyFit, by_solve_ivp, exact, fit_by_scipy

SEED = 1
PAIRS = 3
SIMULATIONS = 20
"""Simulations of ours that are timed as one: a single one is too short for a clock."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """How far two fits of one problem ended apart.

    Attributes
    ----------
    squares, parameters : float
        Difference of the sums of squared errors, and the largest one of a parameter of the line; as shares.
    likelihood : float
        The same difference of the sums as a log-likelihood ratio, ``n dS / S``.
    sigmas : float
        Largest difference of a parameter of the line in standard errors of the fit.
    """

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
