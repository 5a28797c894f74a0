"""A model on a recording it was not fitted to: only the free response of the time before is estimated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.errors import BadModel
from estimator.identification.linear_model import LinearModel
from estimator.identification.offline.blocks import block_of
from estimator.identification.offline.linear_fit import fit_percent, one_step_fit
from estimator.identification.offline.noise_model import NoiseModel
from estimator.identification.offline.problem import Problem
from estimator.signals.record import FloatArray, Record


@dataclass(frozen=True, slots=True, eq=False)
class FreeRun:
    """Free-run simulation next to the measurement.

    Attributes
    ----------
    name : str
        The recording.
    error : ndarray, shape (N,)
        Measured less simulated output [output unit]; NaN where there is none.
    rms : float
        Of the good samples [output unit].
    fit_percent, one_step_fit_percent : float
        In free run, and one step ahead with the noise model given.
    """

    name: str
    error: FloatArray
    rms: float
    fit_percent: float
    one_step_fit_percent: float


def free_run(model: LinearModel, record: Record, noise: NoiseModel) -> FreeRun:
    """Simulate a recording with a model.

    Parameters
    ----------
    model : LinearModel
        Stable.
    record : Record
        Prepared as the one the model was fitted to.
    noise : NoiseModel
        Of the fit; for the prediction one step ahead.

    Raises
    ------
    BadModel
        If the recording is sampled at another period than the model, or the model is unstable.
    """
    period_s = record.sample_time_s
    if not np.isclose(period_s, model.sample_time_s, rtol=1e-3) or not model.is_stable:
        raise BadModel(
            f"recording {record.name}: sampled every {period_s:g} s, the model every {model.sample_time_s:g} s with "
            f"poles of radius up to {np.abs(model.poles).max(initial=0.0):.4g}, expected one period and radii below 1. "
            "Prepare both recordings alike; take a stable estimate."
        )
    first = int(record.okay.argmax())
    u, y, okay = record.total_torque_nm[first:], record.output[first:], record.okay[first:]
    problem = Problem(u, y, okay, model.orders, model.sample_time_s)
    error = np.where(okay, problem.error(problem.start(model)), np.nan)
    return FreeRun(
        name=record.name,
        error=np.concatenate([np.full(first, np.nan), error]),
        rms=float(np.sqrt(np.mean(error[okay] ** 2))),
        fit_percent=fit_percent(error[okay], y[okay]),
        one_step_fit_percent=one_step_fit(error, y, okay, noise, block_of(period_s)),
    )
