"""Up to eight simulations side by side, as a Jacobian takes them: one instruction for all."""

from __future__ import annotations

from typing import Any

import numpy as np

from estimator.compiled import IS_COMPILED, compiled, inlined
from estimator.lanes import LANES, as_lanes, borrowed
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.effects.timing import LowPass, low_pass
from estimator.physics.kernel import slots
from estimator.physics.kernel.conditions import (
    Line,
    bent,
    conditions,
    is_bristled,
    is_changing,
    is_elastic,
    rubbed,
    with_torques,
)
from estimator.physics.kernel.integration import Masses, call_specialised, fed, feed_from, integrate, is_late, with_mode
from estimator.physics.kernel.laws_at import is_waving
from estimator.physics.kernel.linear import is_linear
from estimator.physics.kernel.rates import read_out, stepped
from estimator.physics.kernel.sensing import shown, smoothed
from estimator.physics.kernel.state_vector import (
    BRISTLES_LOAD,
    BRISTLES_MOTOR,
    FILTER_RISE,
    FILTERED,
    LAG_RISE,
    LAGGED,
    Bristles,
    corrected,
    unpacked,
)
from estimator.physics.layout import slot
from estimator.physics.tables import TABLES
from estimator.signals.record import FloatArray, IntArray

MAKING = np.array(
    [slot(entry.name, each.name) for entry in BUILT_IN.values() for each in entry.parameters if not each.own]
    + [slot(entry.name, entry.parameters[0].name) for entry in TABLES.values()]
)
"""Where it is written what a line is made of; phases and moments, which are a recording's own, say when."""

FEEDING = np.array([slots.DELAY, slots.DELAYED_BEFORE, slots.DRIFT, slots.LAG, slots.LAG_SHAPE])
"""What a torque's way to the shaft depends on."""


@compiled
def can_share_lanes(masses: Masses, p: FloatArray, rows: IntArray) -> bool:
    """Tell whether simulations can share SIMD lanes: compiled, not linear, the same effects.

    All take the finest sub-steps that any of them needs: a step that differed between the columns of a Jacobian would
    be a part of their difference.
    """
    first = p[rows[0]]
    if rows.size == 1 or not IS_COMPILED:
        return False
    if is_linear(Line(len(masses), len(masses) == 1 or is_elastic(first), False, ()), first):
        return False
    return leading_compatible(p, rows) == rows.size


@compiled
def leading_compatible(p: FloatArray, rows: IntArray) -> int:
    """Return how many of the lines, a row of parameters each, are kin of the first before one is not."""
    count = 1
    while count < rows.size and are_compatible(p[rows[0]], p[rows[count]]):
        count += 1
    return count


@compiled
def compatible_together(p: FloatArray) -> IntArray:
    """Return the rows of some lines in an order that has those that are kin follow each other."""
    order, placed = np.empty(p.shape[0], dtype=np.int64), np.zeros(p.shape[0], dtype=np.bool_)
    count = 0
    for first in range(p.shape[0]):
        for row in range(first, p.shape[0]):
            if not placed[row] and are_compatible(p[first], p[row]):
                order[count], placed[row] = row, True
                count += 1
    return order


@inlined
def are_compatible(p: FloatArray, other: FloatArray) -> bool:
    """Tell whether two lines are alike but for the size of their parameters."""
    for i in MAKING:
        if (p[i] == 0.0) != (other[i] == 0.0):
            return False
    return True


@inlined
def in_lanes(values: FloatArray, rows: IntArray) -> FloatArray:
    """Return some of the rows (K, N) as columns (N, LANES); lanes that are left over do what the first one does."""
    columns = np.empty((values.shape[1], LANES))
    for lane in range(LANES):
        columns[:, lane] = values[rows[lane if lane < rows.size else 0]]
    return columns


@inlined
def supplied_lanes(
    sample_time_s: float,
    substeps: int,
    first: int,
    start_s: float,
    rows: IntArray,
    torque: FloatArray,
    fed_by: IntArray,
    p: FloatArray,
    state: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return mean and rise of the torques on the shaft as columns, a row per sub-step from sample ``first`` on.

    One per sample, and no rise, where nothing is late.
    """
    samples = torque.shape[1]
    if not is_late(p[rows[0]]):
        return in_lanes(torque, fed_by[rows]), np.zeros((samples, LANES))
    h, length = sample_time_s / substeps, 1.0 / substeps
    mean, rise = np.zeros((samples * substeps, LANES)), np.zeros((samples * substeps, LANES))
    for lane in range(LANES):
        row = rows[lane if lane < rows.size else 0]
        if lane > 0 and are_fed_alike(rows[0], row, fed_by, p, state):
            mean[:, lane], rise[:, lane] = mean[:, 0], rise[:, 0]
            continue
        given = torque[fed_by[row]]
        feed = feed_from(given, start_s / sample_time_s, sample_time_s, p[row], h)
        lagged, lag_rise = state[row, LAGGED], state[row, LAG_RISE]
        for k in range(first, samples):
            for j in range(substeps):
                means, rises, lagged, lag_rise = fed(given, feed, k, j * length, length, lagged, lag_rise, p[row])
                mean[k * substeps + j, lane], rise[k * substeps + j, lane] = means, rises
    return mean, rise


@inlined
def are_fed_alike(row: int, other: int, fed_by: IntArray, p: FloatArray, state: FloatArray) -> bool:
    """Tell whether the torque of two rows reaches the shaft alike: of most columns of a Jacobian it does."""
    for i in FEEDING:
        if p[row, i] != p[other, i]:
            return False
    alike = state[row, LAGGED] == state[other, LAGGED] and state[row, LAG_RISE] == state[other, LAG_RISE]
    return bool(alike and fed_by[row] == fed_by[other])


@inlined
def low_passes(rows: IntArray, p: FloatArray, h: float) -> FloatArray:
    """Return the filters of some rows over steps of ``h`` [s] as columns, shape (fields of a `LowPass`, LANES)."""
    columns = np.empty((7, LANES))
    for lane in range(LANES):
        row = rows[lane if lane < rows.size else 0]
        for i, value in enumerate(low_pass(p[row, slots.FILTER], p[row, slots.FILTER_SHAPE], h)):
            columns[i, lane] = value
    return columns


@inlined
def advance(
    line: Line,
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    first: int,
    start_s: float,
    torque_lanes: FloatArray,
    rise_lanes: FloatArray,
    load_lanes: FloatArray,
    angle: FloatArray,
    followed: FloatArray,
    one_of_them: FloatArray,
    p_lanes: FloatArray,
    state_lanes: FloatArray,
    low_lanes: FloatArray,
    outputs: IntArray,
    filtering: bool,
    out_lanes: FloatArray,
) -> None:
    """Simulate lines of one make; ``one_of_them`` is the parameters of one.

    Of ``out_lanes`` each sample has a row per output, shape (N C, LANES).
    """
    torque, rise, load, p = as_lanes(torque_lanes), as_lanes(rise_lanes), as_lanes(load_lanes), as_lanes(p_lanes)
    start, out, filters = as_lanes(state_lanes), as_lanes(out_lanes), as_lanes(low_lanes)
    h = sample_time_s / substeps
    length = 1.0 / substeps
    waving = is_waving(one_of_them)
    samples, output, following = load_lanes.shape[0], outputs[0], followed.shape[0] > 0
    parts = torque_lanes.shape[0] // samples
    x = unpacked(start)
    bristled, bristles = is_bristled(one_of_them), Bristles(start[BRISTLES_MOTOR], start[BRISTLES_LOAD])
    low = LowPass(filters[0], filters[1], filters[2], filters[3], filters[4], filters[5], filters[6])
    filtered, filter_rise = start[FILTERED], start[FILTER_RISE]
    now = conditions(line.masses, start_s + first * sample_time_s, h, 0.0, load[first], sign_width, p)
    for k in range(first, samples):
        for i in range(outputs.shape[0]):
            seen = filtered if filtering and i == 0 else read_out(line, now, x, outputs[i], p)
            out[k * outputs.shape[0] + i] = seen
        if following:
            x = corrected(x, p[slots.OBSERVER] * (followed[k] - out[k * outputs.shape[0]]), output)
        turn = angle[k + 1] - angle[k] if k + 1 < angle.shape[0] else angle[k] - angle[k - 1]
        time_s = start_s + k * sample_time_s
        varying = waving or is_changing(time_s - sample_time_s, time_s + sample_time_s, p)
        if not varying:
            now = with_torques(now, now.torque, load[k])
        for j in range(substeps):
            if varying:
                middle, place = angle[k] + turn * (j + 0.5) * length, k + j * length
                now = conditions(line.masses, start_s + place * sample_time_s, h, middle, load[k], sign_width, p)
            felt = now
            if bristled:
                bristles = bent(line, bristles, x, now, p, 0.5 * h)
                felt = rubbed(now, bristles, p)
            part, before = k * parts + min(j, parts - 1), x
            x = stepped(line, felt, torque[part], rise[part], x, p, h)
            if bristled:
                bristles = bent(line, bristles, x, now, p, 0.5 * h)
            if filtering:
                turned, turns = angle[k] + turn * j * length, angle[k] + turn * (j + 1) * length
                filtered, filter_rise = smoothed(before, x, output, turned, turns, filtered, filter_rise, low, p, h)


@compiled
def integrate_side_by_side(
    masses: Masses,
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    first: int,
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
) -> None:
    """Do what ``integration.integrate`` does for some rows, at most `LANES`; their states stay as they are."""
    rows, torque, load, angle = borrowed(rows), borrowed(torque), borrowed(load), borrowed(angle)
    followed = borrowed(followed)
    fed_by, loaded_by, outputs = borrowed(fed_by), borrowed(loaded_by), borrowed(outputs)
    p, state, out = borrowed(p), borrowed(state), borrowed(out)
    count, finest = outputs.shape[0], substeps
    for row in rows:
        finest = max(finest, with_mode(substeps, sample_time_s, p[row]))
    values = np.empty((torque.shape[1] * count, LANES))
    mean, rise = supplied_lanes(sample_time_s, finest, first, start_s, rows, torque, fed_by, p, state)
    loads = in_lanes(load, loaded_by[rows])
    given = (sample_time_s, finest, sign_width, first, start_s, mean, rise, loads, angle, followed)
    filtering = sensor and p[rows[0], slots.FILTER] > 0.0
    them = (in_lanes(p, rows), in_lanes(state, rows), low_passes(rows, p, sample_time_s / finest))
    call_specialised(len(masses), (), advance, p[rows[0]], (*given, p[rows[0]], *them, outputs, filtering, values))
    for lane in range(rows.size):
        own = p[rows[lane]]
        for k in range(first, torque.shape[1]):
            for i in range(count):
                value = values[k * count + i, lane]
                out[rows[lane], i, k] = shown(value, angle[k], value, own) if sensor and i == 0 else value


def integrate_each(
    masses: Masses,
    own: tuple[Any, ...],
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    start_s: float,
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
    alike: IntArray,
) -> None:
    """Do what ``integrate`` does for every row, from the start.

    Of shape (K, C, N) is ``out``: N samples of C outputs. Row i is as row 0 before sample ``alike[i]`` and is simulated
    from about there on; ``alike[0]`` is the number of samples. Rows that are kin go side by side where they can, and
    leave their states as they were.

    It is not compiled: that would take the code of both kernels in, and work on it once more for minutes.
    """
    samples, the_first = torque.shape[1], np.zeros(1, dtype=np.int64)
    given: Any = (torque, load, fed_by, loaded_by, angle, followed, p, state, outputs, sensor, out, slopes)

    def one_by_one(rows: IntArray, first: int, last: int) -> None:
        steps = (sample_time_s, substeps, sign_width, first, last, start_s)
        integrate(masses, own, *steps, rows, *given)

    all_differ = not alike[1:].any()
    order, reached = compatible_together(p) if all_differ else 1 + np.argsort(alike[1:]), 0
    while order.size:
        rows = order[: leading_compatible(p, order[:LANES])]
        together = not own and slopes.shape[2] == 0 and can_share_lanes(masses, p, rows)
        rows = rows if together or all_differ else rows[:1]
        order = order[rows.size :]
        common = 0 if all_differ else int(alike[rows[0]])
        if common > reached:
            one_by_one(the_first, reached, common)
            reached = common
        if reached > 0:
            state[rows] = state[0]
            out[rows, :, :reached] = out[0, :, :reached]
            slopes[rows, :, : reached + 1] = slopes[0, :, : reached + 1]
        if together:
            integrate_side_by_side(masses, sample_time_s, substeps, sign_width, reached, start_s, rows, *given[:-1])
        else:
            one_by_one(rows, reached, samples)
    if not all_differ:
        one_by_one(the_first, reached, samples)
