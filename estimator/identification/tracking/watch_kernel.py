"""Compiled: a reference model runs free alongside the driveline; the score of its natural frequency over a block."""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.identification.linear_model import ComplexArray
from estimator.identification.tracking.follow_kernel import NA, NB, NK, shift_in
from estimator.identification.tracking.pole_kernel import DAMPING, FREQUENCY_HZ, dominant, residue, squared
from estimator.identification.tracking.sensitivity_kernel import LAST, pass_torque, sensitivity, weight_of
from estimator.signals.record import BoolArray, FloatArray, IntArray

# Rows of `past`: newest value first.
OUTPUT, INPUT = 0, 1

# Places in `mode`: the reference's resonance.
REFERENCE_HZ = 0  # 0 while there is no reference
POLE_RE, POLE_IM, WEIGHT_RE, WEIGHT_IM = 1, 2, 3, 4
ERROR, OUTPUT_THEN = 5, 6  # of the last sample; NaN where it was not good
N_MODE = 7

# Places in `score`: sums over the present block.
GOOD = 0  # samples that were good, and so was the one before
PSI_E = 1  # sum of psi and the error's step
PSI_2 = 2  # sum of psi^2
ERROR_2, OUTPUT_2 = 3, 4  # sums of the squared steps of error and output
N_SCORE = 5


@compiled
def take_reference(
    theta: FloatArray,
    structure: IntArray,
    sample_time_s: float,
    band: FloatArray,
    work: FloatArray,
    roots: ComplexArray,
    mode: FloatArray,
    through: FloatArray,
) -> None:
    """Take the resonance of a model for reference; none where it has no damped one."""
    na = structure[NA]
    mode[:] = 0.0
    mode[ERROR] = np.nan
    through[:LAST] = 0.0
    found = dominant(theta, na, structure[NK], sample_time_s, band, roots, work)
    if found < 0 or not work[DAMPING] > 0.0 or not squared(roots[found]) < 1.0:
        return
    weight = weight_of(roots[found], residue(theta[na:], structure[NK], roots, found), work[DAMPING], sample_time_s)
    mode[REFERENCE_HZ] = work[FREQUENCY_HZ]
    mode[POLE_RE], mode[POLE_IM] = roots[found].real, roots[found].imag
    mode[WEIGHT_RE], mode[WEIGHT_IM] = weight.real, weight.imag


@compiled
def reference_output(structure: IntArray, theta: FloatArray, past: FloatArray) -> float:
    """Return the next output of the reference model, from its own outputs and the inputs."""
    na = structure[NA]
    value = 0.0
    for i in range(na):
        value -= theta[i] * past[OUTPUT, i]
    for j in range(structure[NB]):
        value += theta[na + j] * past[INPUT, structure[NK] + j]
    return value


@compiled
def take_error(error: float, y: float, mode: FloatArray, through: FloatArray, score: FloatArray) -> None:
    """Take the error of a sample, NaN where it is not good, into the score of its block."""
    psi = sensitivity(complex(mode[WEIGHT_RE], mode[WEIGHT_IM]), through)
    step, y_step = error - mode[ERROR], y - mode[OUTPUT_THEN]
    mode[ERROR], mode[OUTPUT_THEN] = error, y
    if step == step:
        score[GOOD] += 1.0
        score[PSI_E] += psi * step
        score[PSI_2] += psi * psi
        score[ERROR_2] += step * step
        score[OUTPUT_2] += y_step * y_step


@compiled
def watch_block(
    u: FloatArray,
    y: FloatArray,
    okay: BoolArray,
    y_hat: FloatArray,
    structure: IntArray,
    theta: FloatArray,
    mode: FloatArray,
    through: FloatArray,
    past: FloatArray,
    score: FloatArray,
) -> None:
    """Run the reference through the samples of a block; without one, its outputs are those of the estimate.

    Parameters
    ----------
    u, y, okay, y_hat
        The block: samples, which of them are good, outputs simulated by the estimate.
    theta, mode
        The reference model, shapes (n,), (7,).
    through, past, score
        State, shapes (5,), (2, depth), (5,).
    """
    for t in range(u.shape[0]):
        shift_in(past[INPUT], u[t] if np.isfinite(u[t]) else past[INPUT, 0])
        value = y_hat[t]
        if mode[REFERENCE_HZ] > 0.0:
            value = reference_output(structure, theta, past)
            take_error(y[t] - value if okay[t] else np.nan, y[t], mode, through, score)
        pass_torque(past[INPUT, 0], complex(mode[POLE_RE], mode[POLE_IM]), through)
        shift_in(past[OUTPUT], value)
