"""The compiled loop behind :mod:`estimator.identification.tracking.follow`; one code for a block and for one sample."""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.identification.linear_model import ComplexArray
from estimator.identification.tracking.excitation_kernel import (
    SAMPLES,
    end_block,
    forgotten,
    keep_mode,
    take_torque,
)
from estimator.identification.tracking.pole_kernel import (
    DAMPING,
    FREQUENCY_HZ,
    HEIGHT,
    dominant,
    mode_gradient,
    residue,
    squared,
)
from estimator.signals.record import BoolArray, FloatArray, IntArray

# Rows of `past`: newest value first.
Y_HAT = 0
Y_HAT_F = 1  # filtered by the resonance's pair of poles
INPUT = 2
INPUT_F = 3

# Places in `structure`.
NA, NB, NK = 0, 1, 2

# Places in `heard`: the residual as the resonance hears it.
ONCE_RE, ONCE_IM, TWICE_RE, TWICE_IM = 0, 1, 2, 3  # filtered by the pole, and once more
DENSITY = 4  # its density there, as the variance of a white residual [output unit squared]
COUNT = 5  # samples heard so far

# Places in `pair`: 1 + l_1 q^-1 + l_2 q^-2 of the resonance's poles, and what the others amplify there.
L_1, L_2, OTHERS = 0, 1, 2

LEAST_DISTANCE = 0.1  # of the other poles: one that passes by the resonance, while the estimate moves, is no gain

# Places in `numbers`.
SAMPLE_TIME_S, LOWEST_HZ, HIGHEST_HZ, LARGEST_DAMPING, MEMORY, FEWEST, BLOCK, OPENS, CLOSES = range(9)

# Columns of `out`: those of a mode, then
FREQUENCY_STD_HZ, DAMPING_STD = 3, 4

UNIFORM = 12.0**-0.5  # standard deviation of a value that may lie anywhere in a range of 1

USABLE = 0  # estimator.identification.online.recursive.Reason.NONE


@compiled
def shift_in(row: FloatArray, value: float) -> None:
    """Put a value in front; the oldest drops out."""
    for i in range(row.shape[0] - 1, 0, -1):
        row[i] = row[i - 1]
    row[0] = value


@compiled
def through_pair(value: float, pair: FloatArray, row: FloatArray) -> float:
    """Return the next output of the pair's 1 / (1 + l_1 q^-1 + l_2 q^-2), given its last ones in row."""
    return float(value - pair[L_1] * row[0] - pair[L_2] * row[1])


@compiled
def take_pair(roots: ComplexArray, found: int, pair: FloatArray) -> None:
    """Take the resonance's poles into the gradient's filter; an unstable pair leaves the last one in place."""
    pole = roots[found]
    magnitude = np.sqrt(squared(pole))
    if not magnitude < 1.0:
        return
    pair[L_1], pair[L_2] = -2.0 * pole.real, magnitude * magnitude
    others = 1.0 + 0.0j
    for i in range(roots.shape[0]):
        if i != found and squared(roots[i] - pole.conjugate()) > 1e-18:
            others *= 1.0 - roots[i] * (pole.conjugate() * (1.0 / magnitude))
    pair[OTHERS] = 1.0 / max(np.sqrt(squared(others)), LEAST_DISTANCE)


@compiled
def fill_gradient(structure: IntArray, gain: float, outputs: FloatArray, inputs: FloatArray, psi: FloatArray) -> None:
    """Set psi(t-1) = gain [-yhat(t-1) .. , u(t-nk) ..] from rows that hold them, the input's with u(t) in front."""
    na = structure[NA]
    for i in range(na):
        psi[i] = -gain * outputs[i]
    for j in range(structure[NB]):
        psi[na + j] = gain * inputs[structure[NK] + j]


@compiled
def spread(P: FloatArray, psi: FloatArray, K: FloatArray, density: float, v: FloatArray) -> None:
    """P <- (I - K psi^T) P (I - K psi^T)^T + density K K^T; v is room, shape (n,)."""
    n = psi.shape[0]
    c = density
    reach = 0.0
    for i in range(n):
        reach += K[i] * psi[i]
    if abs(reach) > 1.0:  # no correction takes back more than the error it was made for
        for i in range(n):
            psi[i] /= abs(reach)
    for i in range(n):
        v[i] = 0.0
        for j in range(n):
            v[i] += P[i, j] * psi[j]
    for i in range(n):
        c += psi[i] * v[i]
    for i in range(n):
        for j in range(i + 1):
            P[i, j] += c * K[i] * K[j] - v[i] * K[j] - K[i] * v[j]
            P[j, i] = P[i, j]


@compiled
def hear(e: float, pole: complex, memory: float, heard: FloatArray) -> None:
    """Take a residual into its density at the resonance: passed twice through 1 / (1 - pole q^-1)."""
    once = pole * complex(heard[ONCE_RE], heard[ONCE_IM]) + e
    twice = pole * complex(heard[TWICE_RE], heard[TWICE_IM]) + once
    heard[ONCE_RE], heard[ONCE_IM], heard[TWICE_RE], heard[TWICE_IM] = once.real, once.imag, twice.real, twice.imag
    r2 = pole.real**2 + pole.imag**2
    white = (1.0 + r2) / (1.0 - r2) ** 3  # sum over k of (k + 1)^2 r^(2 k): what a white residual of variance 1 gives
    heard[COUNT] += 1.0
    heard[DENSITY] += ((twice.real**2 + twice.imag**2) / white - heard[DENSITY]) / min(heard[COUNT], memory)


@compiled
def form(P: FloatArray, gradient: FloatArray) -> float:
    """Return the standard deviation of a quantity with that gradient over the first parameters."""
    total = 0.0
    for i in range(gradient.shape[0]):
        for j in range(gradient.shape[0]):
            total += gradient[i] * P[i, j] * gradient[j]
    return np.sqrt(total) if total > 0.0 else np.nan


@compiled
def follow_correction(
    structure: IntArray,
    pair: FloatArray,
    past: FloatArray,
    heard: FloatArray,
    e: float,
    step: FloatArray,
    P: FloatArray,
    work: FloatArray,
) -> None:
    """Follow the correction ``step`` of theta that was made for a prediction error e into P."""
    n = step.shape[0]
    psi, K, v = work[0, :n], work[1, :n], work[2, :n]
    if heard[COUNT] > 0.0:
        fill_gradient(structure, pair[OTHERS], past[Y_HAT_F], past[INPUT_F], psi)
    else:
        fill_gradient(structure, 1.0, past[Y_HAT], past[INPUT], psi)
    for i in range(n):
        K[i] = step[i] / e
    spread(P, psi, K, heard[DENSITY], v)


@compiled
def deviations(
    numbers: FloatArray,
    roots: ComplexArray,
    found: int,
    P: FloatArray,
    lasting: FloatArray,
    frequency: FloatArray,
    damping: FloatArray,
    out: FloatArray,
) -> None:
    """Fill the standard deviations of a resonance, no larger than those of a value that may be anywhere."""
    mode_gradient(roots, found, numbers[SAMPLE_TIME_S], frequency, damping)
    wider, widest_hz = np.sqrt(forgotten(lasting)), UNIFORM * (numbers[HIGHEST_HZ] - numbers[LOWEST_HZ])
    out[FREQUENCY_STD_HZ] = min(wider * form(P, frequency), widest_hz)
    out[DAMPING_STD] = min(wider * form(P, damping), UNIFORM * numbers[LARGEST_DAMPING])


@compiled
def follow_block(
    u: FloatArray,
    okay: BoolArray,
    theta: FloatArray,
    y_hat: FloatArray,
    e_prior: FloatArray,
    used: BoolArray,
    reason: np.ndarray,
    structure: IntArray,
    numbers: FloatArray,
    before: FloatArray,
    pair: FloatArray,
    P: FloatArray,
    past: FloatArray,
    heard: FloatArray,
    last_mode: FloatArray,
    through: FloatArray,
    block: FloatArray,
    lasting: FloatArray,
    work: FloatArray,
    roots: ComplexArray,
    out: FloatArray,
) -> None:
    """Follow the estimates of a block.

    Parameters
    ----------
    u, okay, theta, y_hat, e_prior, used, reason
        The block: input, which samples are good, and trajectory.
    before, pair, P, past, heard, last_mode, through, block, lasting
        State: theta of the last sample, shape (n,); shapes (3,), (n, n), (4, depth), (6,); those of
        :mod:`sensitivity_kernel` and :mod:`excitation_kernel`.
    work, roots
        Room, shapes (7, n), (na,).
    out
        Filled, shape (N, 5).
    """
    na, n = structure[NA], theta.shape[1]
    step, frequency, damping, mode = work[3, :n], work[4, :na], work[5, :na], work[6, :3]
    band = numbers[LOWEST_HZ : LARGEST_DAMPING + 1]
    for t in range(u.shape[0]):
        shift_in(past[INPUT], u[t] if np.isfinite(u[t]) else past[INPUT, 0])
        shift_in(past[INPUT_F], through_pair(past[INPUT, 0], pair, past[INPUT_F]))
        if used[t] and e_prior[t] != 0.0:
            step[:] = theta[t] - before
            follow_correction(structure, pair, past, heard, e_prior[t], step, P, work)
        before[:] = theta[t]
        found = -1
        if reason[t] == USABLE:
            found = dominant(theta[t], na, structure[NK], numbers[SAMPLE_TIME_S], band, roots, mode)
        known = found >= 0 and heard[COUNT] >= numbers[FEWEST]
        if known and mode[DAMPING] > 0.0 and squared(roots[found]) < 1.0:
            rho = residue(theta[t, na:], structure[NK], roots, found)
            keep_mode(mode[FREQUENCY_HZ], mode[DAMPING], roots[found], rho, last_mode)
        take_torque(past[INPUT, 0], okay[t], heard[DENSITY], numbers[SAMPLE_TIME_S], last_mode, through, block)
        out[t] = np.nan
        if found >= 0:
            take_pair(roots, found, pair)
            if used[t]:
                hear(e_prior[t], roots[found], numbers[MEMORY], heard)
            out[t, FREQUENCY_HZ], out[t, DAMPING], out[t, HEIGHT] = mode[0], mode[1], mode[2]
        shift_in(past[Y_HAT], y_hat[t])
        shift_in(past[Y_HAT_F], through_pair(y_hat[t], pair, past[Y_HAT_F]))
        if known:
            deviations(numbers, roots, found, P, lasting, frequency, damping, out[t])
        if block[SAMPLES] == numbers[BLOCK]:
            end_block(numbers[MEMORY], numbers[OPENS], numbers[CLOSES], block, lasting)
