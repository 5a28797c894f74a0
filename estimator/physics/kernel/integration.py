"""The one compiled driveline simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from estimator.compiled import compiled, compiled_with_lock, inlined, ir_inlined
from estimator.lanes import borrowed
from estimator.physics.curve import steepest
from estimator.physics.effects.timing import LowPass, delayed, lag_step, low_pass
from estimator.physics.kernel import slots
from estimator.physics.kernel.conditions import (
    Line,
    bent,
    branch_frequency,
    branch_inertia,
    conditions,
    is_bristled,
    is_changing,
    is_elastic,
    is_extended,
    is_within,
    rubbed,
    with_torques,
)
from estimator.physics.kernel.laws_at import is_waving
from estimator.physics.kernel.linear import (
    RESPONSES,
    WORTHWHILE_SAMPLES,
    fill_responses,
    has_dry_friction,
    is_linear,
    next_linear_state,
)
from estimator.physics.kernel.rates import at_moment, read_out
from estimator.physics.kernel.sensing import entry, shown, smoothed
from estimator.physics.kernel.state_vector import (
    BRISTLES_LOAD,
    BRISTLES_MOTOR,
    FILTER_RISE,
    FILTERED,
    LAG_RISE,
    LAGGED,
    STATES,
    Bristles,
    Conditions,
    State,
    corrected,
    pack,
    unpacked,
)
from estimator.signals.record import FloatArray, IntArray

RADIANS_PER_STEP_OF_MODE = 0.6
"""Integration step in radians of the extra mode, which is seen through the motor's inertia only."""

DECAY_PER_STEP, RADIANS_ON_CURVE = 1.0, 0.6
"""Integration step over a curve's fastest decay and mode: fourth order is stable to 2.8, and between knots a curve may
be steeper than a secant."""


PARAMETERS = 10  # which of what ``integrate_made`` takes behind the line are its parameters


class Feed(NamedTuple):
    """What is known of a torque's way before it begins."""

    shifted: bool  # whether it is delayed, or its clock another
    delay: float  # the delay, and the time at sample 0 [samples]
    begun: float  # time at sample 0 [samples]
    before_all: float  # the torque before the first sample [Nm]
    lag: LowPass  # what it lags behind


@inlined
def is_late(p: FloatArray) -> bool:
    """Tell whether a torque reaches the shaft otherwise than it was read."""
    return bool(p[slots.DELAY] != 0.0 or p[slots.DRIFT] != 0.0 or p[slots.LAG] > 0.0)


@inlined
def feed_from(torque: FloatArray, begun: float, sample_time_s: float, p: FloatArray, h: float) -> Feed:
    """Return what is known of the way of a torque, shape (N,), to sub-steps of ``h`` [s]."""
    shifted, before_all = p[slots.DELAY] != 0.0 or p[slots.DRIFT] != 0.0, torque[0] + p[slots.DELAYED_BEFORE]
    lag = low_pass(p[slots.LAG], p[slots.LAG_SHAPE], h)
    return Feed(shifted, p[slots.DELAY] / sample_time_s, begun, before_all, lag)


@inlined
def fed(
    torque: FloatArray,
    feed: Feed,
    k: int,
    part: float,
    length: float,
    lagged: float,
    lag_rise: float,
    p: FloatArray,
) -> tuple[float, float, float, float]:
    """Return mean and rise of the torque on the shaft [Nm] over a sub-step, and the lag's state at its end."""
    place = k + part
    supplied, rise = torque[k], 0.0
    if feed.shifted:
        source = place + (place + feed.begun) * p[slots.DRIFT] - feed.delay
        supplied, rise = delayed(torque, feed.before_all, source, length)
    return lag_step(supplied, rise, lagged, lag_rise, feed.lag)


CompiledIntegrator = Callable[..., None]

Masses = tuple[int, ...]
"""An entry for each mass. Its length is a part of its type, so that only makes of so many masses are compiled."""


@ir_inlined
def call_specialised(
    masses: int, own: tuple[Any, ...], made: CompiledIntegrator, p: FloatArray, given: tuple[Any, ...]
) -> None:
    """Call what is compiled for the make of the line that has these parameters, of 1, 2 or 3 masses."""
    if masses == 1:
        _for_its_states(1, True, own, made, p, given)
    elif masses == 2:
        _for_its_shaft(2, own, made, p, given)
    else:
        _for_its_shaft(3, own, made, p, given)


@ir_inlined
def _for_its_shaft(
    masses: int, own: tuple[Any, ...], made: CompiledIntegrator, p: FloatArray, given: tuple[Any, ...]
) -> None:
    if is_elastic(p):
        _for_its_states(masses, True, own, made, p, given)
    else:
        _for_its_states(masses, False, own, made, p, given)


@ir_inlined
def _for_its_states(
    masses: int, elastic: bool, own: tuple[Any, ...], made: CompiledIntegrator, p: FloatArray, given: tuple[Any, ...]
) -> None:
    if is_extended(p):
        made(Line(masses, elastic, True, own), *given)
    else:
        made(Line(masses, elastic, False, own), *given)


@inlined
def with_tables(substeps: int, sample_time_s: float, p: FloatArray) -> int:
    """Return the integration steps per period that the line and the curves of laws without a name need."""
    if max(p[slots.TABLE_MOTOR_SPEED], p[slots.TABLE_TWIST], p[slots.TABLE_RATE], p[slots.TABLE_LOAD_SPEED]) <= 0.0:
        return substeps
    motor, load = 1.0 / float(p[slots.J_M]), 1.0 / float(p[slots.J_L]) if p[slots.J_L] > 0.0 else 0.0
    stiffness = float(p[slots.K]) + steepest(p, slots.TABLE_TWIST)
    damping = float(p[slots.TABLE_DAMPING]) + steepest(p, slots.TABLE_RATE)
    if p[slots.K] > 0.0:
        damping += float(p[slots.C]) * stiffness / float(p[slots.K])
    decay = (motor + load) * damping
    decay += motor * steepest(p, slots.TABLE_MOTOR_SPEED) + load * steepest(p, slots.TABLE_LOAD_SPEED)
    swing = math.sqrt((motor + load) * stiffness) if load > 0.0 else 0.0
    return max(substeps, math.ceil(sample_time_s * max(decay / DECAY_PER_STEP, swing / RADIANS_ON_CURVE)))


@inlined
def with_mode(substeps: int, sample_time_s: float, p: FloatArray) -> int:
    """Return the integration steps per period that the line, its extra mode and its curves need."""
    substeps = with_tables(substeps, sample_time_s, p)
    inertia = branch_inertia(p)
    if inertia <= 0.0:
        return substeps
    fastest = branch_frequency(p)
    if is_within(p):  # it moves against what is beyond its spring, and on the shaft's spring, too
        beyond = float(p[slots.J_M] if p[slots.BETWEEN] > 0.0 else p[slots.J_L])
        fastest = math.sqrt(fastest * fastest * (1.0 + inertia / beyond) + float(p[slots.K]) / inertia)
    return max(substeps, math.ceil(fastest * sample_time_s / RADIANS_PER_STEP_OF_MODE))


@inlined
def slope_before(k: int, slopes: FloatArray) -> float:
    """Return the slope that was left before a sample; 0 where none are wanted."""
    return float(slopes[0, k]) if k < slopes.shape[1] else 0.0


@inlined
def leave_slope(k: int, slope: float, slopes: FloatArray) -> None:
    """Leave the slope before a sample where there is room for it."""
    if k < slopes.shape[1]:
        slopes[0, k] = slope


@inlined
def next_state_with_friction(
    line: Line,
    summing: bool,
    to: FloatArray,
    now: Conditions,
    torque: float,
    rise: float,
    x: State,
    bristles: Bristles,
    p: FloatArray,
    h: float,
) -> tuple[State, Bristles]:
    """Return the state that follows on ``x``, and the bristles', where there are any."""
    bristled, felt = is_bristled(p), now
    if bristled:
        bristles = bent(line, bristles, x, now, p, 0.5 * h)
        felt = rubbed(now, bristles, p)
    after = next_linear_state(line, summing, to, felt, torque, rise, x, p, h)
    if bristled:
        bristles = bent(line, bristles, after, now, p, 0.5 * h)
    return after, bristles


@inlined
def integrate_made(  # one question more than usual, and a change costs each user a minute
    line: Line,
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    first: int,
    last: int,
    start_s: float,
    torque: FloatArray,
    load: FloatArray,
    angle: FloatArray,
    followed: FloatArray,
    p: FloatArray,
    state: FloatArray,
    outputs: IntArray,
    sensor: bool,
    out: FloatArray,
    slopes: FloatArray,
) -> None:
    """Do what ``integrate`` does, for a line whose make is known when it is compiled."""
    substeps = with_mode(substeps, sample_time_s, p)
    h = sample_time_s / substeps
    length = 1.0 / substeps
    feed = feed_from(torque, start_s / sample_time_s, sample_time_s, p, h)
    low = low_pass(p[slots.FILTER], p[slots.FILTER_SHAPE], h)
    waving, filtering = is_waving(p), p[slots.FILTER] > 0.0
    steep, following = slopes.shape[1] > 0, followed.shape[0] > 0
    slope = slope_before(first, slopes)
    output = outputs[0]
    linear = torque.shape[0] >= WORTHWHILE_SAMPLES and is_linear(line, p)
    whole = not (is_late(p) or filtering or steep or has_dry_friction(p))
    leap = substeps if whole else 1
    x = unpacked(state)
    lagged, lag_rise = state[LAGGED], state[LAG_RISE]
    filtered, filter_rise = state[FILTERED], state[FILTER_RISE]
    bristles = Bristles(state[BRISTLES_MOTOR], state[BRISTLES_LOAD])
    now = conditions(line.masses, start_s + first * sample_time_s, h, 0.0, 0.0, sign_width, p)
    to, read = np.empty((RESPONSES, STATES)), False
    for k in range(first, last):
        turn = angle[k + 1] - angle[k] if k + 1 < angle.shape[0] else angle[k] - angle[k - 1]
        for i in range(outputs.shape[0]):
            value = read_out(line, now, x, outputs[i], p)
            out[i, k] = shown(value, angle[k], filtered, p) if sensor and i == 0 else value
        leave_slope(k, slope, slopes)
        if following:
            x = corrected(x, p[slots.OBSERVER] * (followed[k] - out[0, k]), output)
        time_s = start_s + k * sample_time_s
        varying = waving or len(line.own) > 0 or is_changing(time_s - sample_time_s, time_s + sample_time_s, p)
        if not varying:
            now = with_torques(now, now.torque, load[k])
        summing = linear and not varying
        if summing and not read:
            fill_responses(line, now, p, h, leap, to)
        read = summing
        for j in range(0, substeps, leap if summing else 1):
            if varying:
                middle, place = angle[k] + turn * (j + 0.5) * length, k + j * length
                now = conditions(line.masses, start_s + place * sample_time_s, h, middle, load[k], sign_width, p)
            mean, rise, lagged, lag_rise = fed(torque, feed, k, j * length, length, lagged, lag_rise, p)
            before = x
            moment_s = start_s + (k + (j + 0.5) * length) * sample_time_s
            x, bristles = next_state_with_friction(
                at_moment(line, moment_s, k), summing, to, now, mean, rise, before, bristles, p, h
            )
            slope = (entry(x, output, p) - entry(before, output, p)) / h
            if filtering:
                turned, turns = angle[k] + turn * j * length, angle[k] + turn * (j + 1) * length
                filtered, filter_rise = smoothed(before, x, output, turned, turns, filtered, filter_rise, low, p, h)
            if steep and j == 0:
                slopes[1, k] = slope
    leave_slope(last, slope, slopes)
    pack(x, state)
    state[LAGGED], state[LAG_RISE] = lagged, lag_rise
    state[FILTERED], state[FILTER_RISE] = filtered, filter_rise
    state[BRISTLES_MOTOR], state[BRISTLES_LOAD] = bristles.motor, bristles.load


@compiled
def integrate(
    masses: Masses,
    own: tuple[Any, ...],
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    first: int,
    last: int,
    start_s: float,
    rows: IntArray,
    torque: FloatArray,
    load: FloatArray,
    fed_by: IntArray,
    loaded_by: IntArray,
    angle: FloatArray,
    followed: FloatArray,
    p: FloatArray,
    state: FloatArray,
    outputs: IntArray,
    sensor: bool,
    out: FloatArray,
    slopes: FloatArray,
) -> None:
    """Simulate samples ``first`` to ``last``, without this one; as an observer of the readings that are ``followed``.

    Some rows of ``p``, ``state``, ``out`` and ``slopes``, one after the other: row i is driven by the rows
    ``fed_by[i]`` of ``torque`` and ``loaded_by[i]`` of ``load``. Column k of its outputs, shape (C, N), is the states'
    entries before torque k acts.
    """
    rows, fed_by, loaded_by, outputs = borrowed(rows), borrowed(fed_by), borrowed(loaded_by), borrowed(outputs)
    torque, load, angle, followed = borrowed(torque), borrowed(load), borrowed(angle), borrowed(followed)
    p, state, out, slopes = borrowed(p), borrowed(state), borrowed(out), borrowed(slopes)
    steps = (sample_time_s, substeps, sign_width, first, last, start_s)
    for row in rows:
        driven = (torque[fed_by[row]], load[loaded_by[row]], angle, followed, p[row], state[row])
        found = (outputs, sensor, out[row], slopes[row])
        call_specialised(len(masses), own, integrate_made, p[row], (*steps, *driven, *found))


@compiled_with_lock
def integrate_period(masses: Masses, own: tuple[Any, ...], *given: Any) -> None:
    """Do what ``integrate`` does for one line, for a rig that is stepped period by period.

    ``given`` is what ``integrate_made`` takes behind the line.
    """
    call_specialised(len(masses), own, integrate_made, given[PARAMETERS], given)
