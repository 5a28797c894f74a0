"""Covariance of estimated parameters when the residual is coloured.

An output-error fit is consistent whatever the residual's colour, but ``sigma^2 (J^T J)^-1`` is its covariance for a
white one only. With e = w / D and psi(t) the gradient of the prediction (L. Ljung, System Identification, 2nd ed.,
section 9.4, the case of a fixed noise model)::

    cov theta = R^-1 Q R^-1,      R = sum psi psi^T,      Q = sigma_w^2 sum psi_h psi_h^T
    psi_h(t)  = sum_i h_i psi(t+i),   h the impulse response of 1 / D

which is the sandwich with the residual's own autocorrelation in the middle. Masked samples have psi = 0.
"""

from __future__ import annotations

import numpy as np

from estimator.identification.offline.noise_model import NoiseModel
from estimator.signals.record import BoolArray, FloatArray


def sandwich(gradient: FloatArray, okay: BoolArray, noise: NoiseModel) -> FloatArray:
    """Return the covariance of all parameters of a least-squares fit, shape (n, n).

    Parameters
    ----------
    gradient : ndarray, shape (N, n)
        d prediction / d parameters.
    okay : ndarray of bool, shape (N,)
        Samples that were fitted.
    noise : NoiseModel
        Of the residual.
    """
    psi = np.where(okay[:, np.newaxis], gradient, 0.0)
    n_samples = int(np.count_nonzero(okay))
    spent = psi.shape[1] + noise.order
    bread = np.linalg.pinv(psi.T @ psi, hermitian=True)
    psi_h = noise.coloured_backwards(psi)
    scale = noise.std**2 * n_samples / max(n_samples - spent, 1)
    return np.asarray(scale * bread @ (psi_h.T @ psi_h) @ bread, dtype=np.float64)
