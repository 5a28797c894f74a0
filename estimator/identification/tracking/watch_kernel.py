"""The compiled loop behind :mod:`estimator.identification.tracking.watch`; one code for a block and for one sample."""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.identification.tracking.follow_kernel import INPUT, NA, NB, NK, shift_in
from estimator.signals.record import BoolArray, FloatArray, IntArray

# Rows of `past`: newest value first. INPUT has the place it has in follow_kernel.
Y_REF = 0  # free run of the reference model
Y_REF_F = 1  # filtered by the resonance's pair of poles

# Places in `slope`: the pair 1 + l_1 q^-1 + l_2 q^-2, and its change with the frequency.
L_1, L_2, DL_1, DL_2 = 0, 1, 2, 3

# Places in `live`.
PHASE = 0
WAITED = 1  # usable samples since the beginning of SETTLING
IN_BLOCK = 2  # samples of the present block
GOOD = 3  # ... that were used
SCORE = 4  # sum of psi e over them
POWER = 5  # sum of psi^2
BLOCKS = 6  # blocks of the reference
MEAN, SQUARES = 7, 8  # of their statistics, and the sum of squared distances from it
RUN = 9  # side of the last block, if it was beyond the threshold: -1, 0, 1
LAST = 10  # last statistic, standardised
ALARMED = 11  # 1 from an alarm until the estimate has settled
BEFORE_HZ, BEFORE_STD_HZ = 12, 13  # the resonance when the last block within the threshold ended
SINCE_IN_BOUNDS = 14  # samples since that block began: the change is not older
REFERENCE_HZ = 15  # resonance of the reference model
PLACES = 16

# Phases.
SETTLING, REFERENCE, WATCHING = 0, 1, 2

# Places in `numbers`.
SAMPLE_TIME_S, BLOCK, REFERENCE_BLOCKS, SETTLING_SAMPLES, FEWEST_SHARE, THRESHOLD, SMALLEST = 0, 1, 2, 3, 4, 5, 6

# Columns of `out`.
EVENT, STATISTIC, OUT_BEFORE_HZ, OUT_BEFORE_STD_HZ, OUT_SINCE = 0, 1, 2, 3, 4

# Events.
NOTHING, CHANGED, SETTLED = 0, 1, 2


@compiled
def take_slope(frequency_hz: float, damping: float, sample_time_s: float, slope: FloatArray) -> None:
    """Set the pair of poles of a mode, and how its coefficients change with its natural frequency."""
    turning = 2.0 * np.pi * sample_time_s * np.sqrt(1.0 - damping * damping)
    decay = 2.0 * np.pi * sample_time_s * damping
    radius, angle = np.exp(-decay * frequency_hz), turning * frequency_hz
    slope[L_1], slope[L_2] = -2.0 * radius * np.cos(angle), radius * radius
    slope[DL_1] = 2.0 * radius * (decay * np.cos(angle) + turning * np.sin(angle))
    slope[DL_2] = -2.0 * decay * radius * radius


@compiled
def reference_output(structure: IntArray, reference: FloatArray, past: FloatArray) -> float:
    """Return the next output of the reference model, from its own outputs and the inputs."""
    na = structure[NA]
    value = 0.0
    for i in range(na):
        value -= reference[i] * past[Y_REF, i]
    for j in range(structure[NB]):
        value += reference[na + j] * past[INPUT, structure[NK] + j]
    return value


@compiled
def begin(phase: float, live: FloatArray) -> None:
    """Begin a phase with empty sums."""
    live[PHASE] = phase
    for place in (WAITED, IN_BLOCK, GOOD, SCORE, POWER, RUN, LAST):
        live[place] = 0.0
    if phase == REFERENCE:
        live[BLOCKS], live[MEAN], live[SQUARES] = 0.0, 0.0, 0.0


@compiled
def end_block(numbers: FloatArray, live: FloatArray, frequency_hz: float, std_hz: float) -> int:
    """Judge a whole block; return the event."""
    enough = live[GOOD] >= numbers[FEWEST_SHARE] * numbers[BLOCK] and live[POWER] > 0.0
    statistic = live[SCORE] / np.sqrt(live[POWER]) if enough else 0.0
    tolerated = numbers[SMALLEST] * live[REFERENCE_HZ] * np.sqrt(live[POWER])  # what the smallest change makes of it
    for place in (IN_BLOCK, GOOD, SCORE, POWER):
        live[place] = 0.0
    if not enough:
        live[RUN] = 0.0
        return NOTHING
    if live[PHASE] == REFERENCE:
        live[BLOCKS] += 1.0
        away = statistic - live[MEAN]
        live[MEAN] += away / live[BLOCKS]
        live[SQUARES] += away * (statistic - live[MEAN])
        if live[BLOCKS] == numbers[REFERENCE_BLOCKS]:
            live[PHASE] = WATCHING
            live[BEFORE_HZ], live[BEFORE_STD_HZ], live[SINCE_IN_BOUNDS] = frequency_hz, std_hz, numbers[BLOCK]
        return NOTHING
    n = live[BLOCKS]
    away = statistic - live[MEAN]
    away = np.sign(away) * max(abs(away) - tolerated, 0.0)
    live[LAST] = away / np.sqrt(live[SQUARES] / (n - 1.0) * (1.0 + 1.0 / n))
    side = 0.0
    if abs(live[LAST]) > numbers[THRESHOLD]:
        side = np.sign(live[LAST])
    alarm = side != 0.0 and side == live[RUN]
    live[RUN] = side
    if side == 0.0 and frequency_hz == frequency_hz:
        live[BEFORE_HZ], live[BEFORE_STD_HZ], live[SINCE_IN_BOUNDS] = frequency_hz, std_hz, numbers[BLOCK]
    return CHANGED if alarm else NOTHING


@compiled
def watch_block(
    u: FloatArray,
    y: FloatArray,
    used: BoolArray,
    theta: FloatArray,
    y_hat: FloatArray,
    modes: FloatArray,
    structure: IntArray,
    numbers: FloatArray,
    reference: FloatArray,
    slope: FloatArray,
    past: FloatArray,
    live: FloatArray,
    out: FloatArray,
) -> None:
    """Watch the samples of a block.

    Parameters
    ----------
    u, y, used, theta, y_hat
        The block: samples and trajectory.
    modes
        Frequency, its standard deviation and the damping of each, shape (N, 3); NaN where not known.
    reference, slope, past, live
        State, shapes (n,), (4,), (3, depth), (PLACES,).
    out
        Filled, shape (N, 5).
    """
    for t in range(u.shape[0]):
        frequency_hz, std_hz, damping = modes[t, 0], modes[t, 1], modes[t, 2]
        shift_in(past[INPUT], u[t] if np.isfinite(u[t]) else past[INPUT, 0])
        out[t] = np.nan
        out[t, EVENT] = NOTHING
        live[SINCE_IN_BOUNDS] += 1.0
        if live[PHASE] == SETTLING:
            shift_in(past[Y_REF], y_hat[t])
            if used[t] and std_hz == std_hz:
                live[WAITED] += 1.0
            if live[WAITED] > live[ALARMED] * numbers[SETTLING_SAMPLES] and std_hz == std_hz and damping > 0.0:
                reference[:] = theta[t]
                take_slope(frequency_hz, damping, numbers[SAMPLE_TIME_S], slope)
                past[Y_REF_F, :] = 0.0
                live[REFERENCE_HZ] = frequency_hz
                begin(REFERENCE, live)
                live[IN_BLOCK] = -numbers[BLOCK]  # one block for the gradient's filter to fill
                if live[ALARMED] == 1.0:
                    out[t, EVENT] = SETTLED
                live[ALARMED] = 0.0
            continue
        psi = -(slope[DL_1] * past[Y_REF_F, 0] + slope[DL_2] * past[Y_REF_F, 1])
        y_ref = reference_output(structure, reference, past)
        filtered = y_ref - slope[L_1] * past[Y_REF_F, 0] - slope[L_2] * past[Y_REF_F, 1]
        shift_in(past[Y_REF_F], filtered)
        shift_in(past[Y_REF], y_ref)
        live[IN_BLOCK] += 1.0
        if used[t] and live[IN_BLOCK] > 0.0:
            live[GOOD] += 1.0
            live[SCORE] += psi * (y[t] - y_ref)
            live[POWER] += psi * psi
        if live[IN_BLOCK] == numbers[BLOCK]:
            event = end_block(numbers, live, frequency_hz, std_hz)
            if live[PHASE] == WATCHING:
                out[t, STATISTIC] = live[LAST]
            if event == CHANGED:
                out[t, EVENT] = event
                out[t, OUT_BEFORE_HZ], out[t, OUT_BEFORE_STD_HZ] = live[BEFORE_HZ], live[BEFORE_STD_HZ]
                out[t, OUT_SINCE] = live[SINCE_IN_BOUNDS]
                live[ALARMED] = 1.0
                begin(SETTLING, live)
