"""A model on a recording: only the load torque and the initial state are estimated, everything else is the model's."""

from __future__ import annotations

from dataclasses import dataclass, replace

from estimator.physics.fit import FitResult, Problem, fit, make_problem, start_of, start_vector
from estimator.physics.layout import slot
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import Grid, Start
from estimator.signals.record import BoolArray, FloatArray, Record


@dataclass(frozen=True, slots=True)
class FreeRun:
    """A free-run simulation of one recording.

    Attributes
    ----------
    output : ndarray, shape (N,)
        Simulated output, in the unit of the recording's.
    rms : float
        RMS of its error over the good samples.
    start : Start
        Load torque and initial state that were estimated.
    """

    output: FloatArray
    rms: float
    start: Start


def free_run(model: DrivelineModel, record: Record) -> FreeRun:
    """Simulate one recording with a model from its measured torques.

    Raises
    ------
    BadModel
        Where the model's structure does not have the recorded output.
    """
    problem = make_problem(model, [record], ())
    result = settle(problem)
    return FreeRun(result.outputs[0], result.rms, start_of(problem, result.x, 0))


def settle(problem: Problem) -> FitResult:
    """Estimate load torque and initial state of a problem of one recording without shared unknowns.

    With a gap in the line the recording may begin on either flank or between them, and the error has an optimum near
    each: every one is tried.
    """
    start = start_vector(problem)
    twist, gap_rad = problem.local[0].twist_index, float(problem.p[slot("backlash", "gap_rad")])
    starts = [start]
    if twist is not None and gap_rad > 0.0:
        for side in (-0.5, 0.5):
            starts.append(start.copy())
            starts[-1][twist] += side * gap_rad / problem.local[0].scale[twist]
    results = [fit(problem, x0) for x0 in starts]
    return min(results, key=lambda result: result.rms)


def simulate_foreign(
    model: DrivelineModel,
    p: FloatArray,
    grid: Grid,
    record: Record,
    use: BoolArray,
    profile: bool = False,
) -> FloatArray:
    """Simulate a recording with a parameter vector that was fitted to others.

    Parameters
    ----------
    p : ndarray, shape (layout.SIZE,)
        Parameters.
    use : ndarray of bool, shape (N,)
        Samples from which what is the recording's own is estimated.
    profile : bool
        Whether a load profile over time belongs to it.

    Returns
    -------
    ndarray, shape (N,)
    """
    own = make_problem(model, [record], (), profile=profile, use=[use], grid=grid)
    return settle(replace(own, p=p)).outputs[0]
