"""What the recursive estimators are timed on: a driveline of the paper's orders under a PRBS, without end if asked."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from estimator.identification.linear_model import LinearModel
from estimator.signals.prbs import prbs_nm
from estimator.signals.record import BoolArray, FloatArray

# Two pole pairs: 8 Hz with 6 % damping and 15 Hz with 20 %, sampled every 20 ms; b of a size as those of a driveline.
POLES = np.array([0.94 * np.exp(1j), 0.69 * np.exp(1.85j)])
MODEL = LinearModel(
    a=tuple(np.real(np.poly([*POLES, *POLES.conj()]))[1:].tolist()),
    b=(0.008, -0.006, 0.004, -0.003),
    nk=1,
    sample_time_s=0.02,
)
NOISE_RAD_S = 0.05
PRBS_NM = 60.0

Data = tuple[FloatArray, FloatArray, BoolArray]


def data(n: int, seed: int = 0) -> Data:
    """Return torque, speed and mask of n samples."""
    u = prbs_nm(n, PRBS_NM, seed=seed + 1)
    y = MODEL.simulate(u) + NOISE_RAD_S * np.random.default_rng(seed).normal(size=n)
    return u, y, np.ones(n, dtype=np.bool_)


def regressors(u: FloatArray, y: FloatArray) -> FloatArray:
    """Return the rows of least squares, shape (N, na+nb), zero before the first sample."""
    orders = MODEL.orders
    past_y = sliding_window_view(np.concatenate([np.zeros(orders.na), y[:-1]]), orders.na)[:, ::-1]
    past_u = sliding_window_view(np.concatenate([np.zeros(orders.nb), u[:-1]]), orders.nb)[:, ::-1]
    return np.column_stack([-past_y, past_u])
