"""The noise of a free run: that of the speed's reading, and what the noise of the torque's readings moves.

A model is driven by the torques as they were read. With y = G u + v and u read as u + e, the error y - G (u + e) of the
true model is v - G e: white noise, and slow and resonant noise next to it. The truth without an effect is linear, so
one answer to a pulse of torque gives G, and the covariance is sigma^2 I + s^2 G G'. Rounding to a step q adds q^2 / 12.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy import linalg

from hil.proof.power.drive import drive
from hil.proof.truth.acquisition import FAULTLESS, Acquisition
from hil.proof.truth.physics import FloatArray
from hil.proof.truth.sensors import SPEED_NOISE_RAD_S, TORQUE_NOISE_NM, TORQUE_QUANTUM_NM
from hil.proof.truth.specimen import draw_specimen

INVERTERS = 2

PULSE_NM = 1.0

BUSES_KEPT = 2
"""A factor of 3000 rows has 72 MB."""


def deviation_rad_s(acquisition: Acquisition) -> float:
    """Return the standard deviation of a speed reading: sensor noise, and rounding to a grid where there is one."""
    return math.sqrt(SPEED_NOISE_RAD_S**2 + acquisition.grid_rad_s**2 / 12.0)


def torque_deviation_nm() -> float:
    """Return the standard deviation of the sum of both torque readings."""
    return math.sqrt(INVERTERS * (TORQUE_NOISE_NM**2 + TORQUE_QUANTUM_NM**2 / 12.0))


def answer_rad_s(seed: int, samples: int) -> FloatArray:
    """Return what 1 Nm for one period moves the speed of a seed's bus by, from that period on, shape (samples,)."""
    still = drive(draw_specimen("none", seed), 0, samples)
    pulse = np.zeros(samples)
    pulse[0] = PULSE_NM
    moved: FloatArray = replace(still, m1_nm=still.m1_nm + pulse).speed_rad_s() - still.speed_rad_s()
    return moved / PULSE_NM


@lru_cache(maxsize=BUSES_KEPT)
def _factor(seed: int, samples: int) -> FloatArray:
    answers = linalg.toeplitz(answer_rad_s(seed, samples), np.zeros(samples))
    covariance = torque_deviation_nm() ** 2 * (answers @ answers.T)
    covariance[np.diag_indices(samples)] += deviation_rad_s(FAULTLESS) ** 2
    factor: FloatArray = linalg.cholesky(covariance, lower=True, overwrite_a=True)
    return factor


def whitened(moved: FloatArray, seed: int, samples: int) -> FloatArray:
    """Return outputs in which the noise of a seed's free runs is white and of deviation 1.

    Parameters
    ----------
    moved
        Outputs [rad/s], shape (R N,) or (R N, K): recordings of N samples one behind the other.
    seed
        What the bus was drawn from.
    samples
        N.
    """
    factor = _factor(seed, samples)
    pieces = np.split(moved, moved.shape[0] // samples)
    return np.concatenate([linalg.solve_triangular(factor, piece, lower=True) for piece in pieces])
