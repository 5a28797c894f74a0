"""What every off-line estimator returns: the model, its covariance, how well it does in free run and one step ahead.

Two fits, never one without the other. *Free run*: the output simulated from the input alone, which is what a model is
for. *One step*: the next output predicted with the last measured ones at hand; on slow signals it is near 100 % for
any model and says little.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from estimator.identification.linear_model import LinearModel
from estimator.identification.offline.blocks import Blocks
from estimator.identification.offline.noise_model import NoiseModel
from estimator.identification.offline.problem import simulated
from estimator.signals.record import BoolArray, FloatArray


class Method(Enum):
    """Off-line estimators; the value is the name in reports."""

    OUTPUT_ERROR = "output_error"
    BOX_JENKINS = "box_jenkins"


@dataclass(frozen=True, slots=True, eq=False)
class LinearFit:
    """A fitted model and how well it does.

    Attributes
    ----------
    method : Method
        Which estimator.
    model : LinearModel
        Transfer function.
    covariance : ndarray, shape (na+nb, na+nb)
        Covariance of theta, the residual's colour taken into account.
    state : ndarray, shape (n_states + 1,)
        ``[c, h]``: numerator of the free response from sample ``first`` of the data, and that of the high-pass.
    first : int
        First good sample; the simulation starts there.
    rms : float
        RMS of the free-run simulation error [output unit].
    fit_percent : float
        ``100 (1 - |y - yhat| / |y - mean y|)`` in free run, the normalised RMS fit (not R squared).
    one_step_fit_percent : float
        The same for the prediction one step ahead.
    noise : NoiseModel
        Of the free-run residual; predicts one step ahead.
    block : int
        Samples whose mean residual is one sample to the noise model.
    n_samples : int
        Good samples used.
    """

    method: Method
    model: LinearModel
    covariance: FloatArray
    state: FloatArray
    first: int
    rms: float
    fit_percent: float
    one_step_fit_percent: float
    noise: NoiseModel
    n_samples: int
    block: int = 1

    def simulate(self, u: FloatArray) -> FloatArray:
        """Free-run simulation over the data's inputs, shape (N,); the time before ``first`` is 0."""
        out = np.zeros(u.shape[0])
        out[self.first :] = simulated(self.model, u[self.first :], self.state)
        return out


def fit_percent(error: FloatArray, measured: FloatArray) -> float:
    """Return the normalised RMS fit [%] of errors, shape (n,), against the outputs they belong to."""
    spread = float(np.linalg.norm(measured - measured.mean()))
    return 100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread > 0.0 else float("nan")


def one_step_fit(error: FloatArray, y: FloatArray, okay: BoolArray, noise: NoiseModel, block: int) -> float:
    """Return the fit [%] of the prediction one step of the noise model ahead; NaN where no past is complete."""
    blocks = Blocks(okay, block)
    complete = noise.complete(blocks.okay)
    if not complete.any():
        return float("nan")
    return fit_percent(noise.whiten(blocks.mean(error))[complete], blocks.mean(y)[complete])


def summary(
    method: Method,
    model: LinearModel,
    covariance: FloatArray,
    state: FloatArray,
    first: int,
    y: FloatArray,
    okay: BoolArray,
    error: FloatArray,
    noise: NoiseModel,
    block: int,
) -> LinearFit:
    """Put a result together; y, okay and the free-run error of shape (N - first,)."""
    return LinearFit(
        method=method,
        model=model,
        covariance=covariance,
        state=state,
        first=first,
        rms=float(np.sqrt(np.mean(error[okay] ** 2))),
        fit_percent=fit_percent(error[okay], y[okay]),
        one_step_fit_percent=one_step_fit(error, y, okay, noise, block),
        noise=noise,
        n_samples=int(np.count_nonzero(okay)),
        block=block,
    )
