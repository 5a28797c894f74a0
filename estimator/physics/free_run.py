"""A model on a recording: only the load torque and the initial state are estimated, everything else is the model's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.physics.fit import fit, make_problem, start_of
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import Start
from estimator.signals.record import FloatArray, Record


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
    result = fit(problem)
    return FreeRun(result.outputs[0], result.rms, start_of(problem, result.x, 0))


def free_runs(model: DrivelineModel, records: Sequence[Record]) -> tuple[FloatArray, ...]:
    """Simulate several recordings with a model; each as ``free_run`` does."""
    return tuple(np.asarray(free_run(model, record).output) for record in records)
