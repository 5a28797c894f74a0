"""The line of a fit: what happens in it, how much its laws change, and as what a disturbance of it spreads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from scipy.linalg import expm

from estimator.compiled import compiled
from estimator.physics.fit import FitResult
from estimator.physics.kernel import slots, state_vector
from estimator.physics.kernel.laws_at import (
    has_dry_friction_at_load,
    has_dry_friction_at_motor,
    load_sliding,
    motor_sliding,
)
from estimator.physics.layout import slot
from estimator.physics.model import Structure
from estimator.physics.motion import motor_angle
from estimator.physics.problem import case_of
from estimator.physics.simulate import simulate_each
from estimator.signals.record import FloatArray, Location, OutputKind, Record, by_output

AROUND = 2  # samples before and behind a moment between which a law's change counts
LASTS = 3.0  # samples over which such an error is correlated: about as long as a change counts

_STAGE, _STAGE_FROM = (slot("stiffness_nonlinearity", name) for name in ("stage_share", "stage_rad"))


@dataclass(frozen=True, slots=True)
class Motion:
    """What happens in one recording, for laws to be functions of; arrays of shape (N,).

    ``angle`` is by the recording's own output.
    """

    time_s: FloatArray  # from the recording's beginning
    torque: FloatArray  # sum of the inputs [Nm]
    angle: FloatArray
    speed: FloatArray  # of the motor
    twist: FloatArray  # of the shaft
    load_speed: FloatArray  # behind the shaft; of one mass the motor's


def simulated(result: FitResult, index: int, state: int | None = None) -> FloatArray:
    """Simulate a recording at a fit's unknowns: its output, or a state; shape (N,)."""
    problem = result.problem
    case = case_of(problem.local[index], result.p, result.local_of(index))
    return simulate_each(problem.grid, problem.records[index], [case], state)[0]


def motion_of(result: FitResult, index: int, is_between: bool = False) -> Motion:
    """Return what happens in a recording as a fit simulates it, sample by sample.

    Half a sample later, where ``is_between``: there the torque held from a sample on has its middle.
    """
    record = result.problem.records[index]
    wanted = (state_vector.SPEED, state_vector.TWIST, state_vector.LOAD_SPEED)
    speed, twist, load_speed = (simulated(result, index, state) for state in wanted)
    if result.problem.grid.structure is Structure.ONE_MASS:
        load_speed = speed
    moved = (motor_angle(record), speed, twist, load_speed)
    return Motion(record.time_s, record.total_torque_nm, *(map(_between, moved) if is_between else moved))


def _between(values: FloatArray) -> FloatArray:
    later = np.append(values[1:], 2.0 * values[-1] - values[-2])
    return 0.5 * (values + later)


@dataclass(frozen=True, slots=True)
class LinearLine:
    """The linear line as disturbances see it, sampled."""

    f: FloatArray  # (n, n): how the state changes from sample to sample
    torque: FloatArray  # (n,)
    load: FloatArray  # (n,)
    h: FloatArray  # (C, n): how each output shows the state
    direct: float = 0.0  # how the load shows in the output at once
    shaft: FloatArray = field(default_factory=lambda: np.zeros(0))  # (n,)


def line_values(result: FitResult) -> dict[str, float]:
    """Return the values of the line's own parameters in a fit, those that it may not change among them."""
    return {name: float(result.p[slot("", name)]) for name in result.problem.grid.structure.parameter_names}


def line_of(result: FitResult) -> LinearLine:
    """Return the linear line with a fit's values, as the recordings' outputs show it.

    Effects beyond it do not change how disturbances spread.
    """
    records, structure = result.problem.records, result.problem.grid.structure
    outputs = [records[part.start] for part in by_output(records)]
    if structure is Structure.JOINT:
        nothing = np.zeros(0)
        return LinearLine(np.zeros((0, 0)), nothing, nothing, np.zeros((len(outputs), 0)), 1.0)
    values = line_values(result)
    a, at_motor, at_load = _continuous(values)
    n = a.shape[0]
    h = np.array([_seen(record, a, values) / record.unit for record in outputs])
    joined = np.zeros((n + 3, n + 3))
    joined[:n, :n], joined[:n, n], joined[:n, n + 1], joined[:n, n + 2] = a, at_motor, at_load, _at_shaft(values)
    moved = expm(joined * outputs[0].sample_time_s)
    keep = list(range(n if h[:, -1].any() else n - 1))  # the angle stands last
    return LinearLine(
        moved[np.ix_(keep, keep)], moved[keep, n], moved[keep, n + 1], h[:, keep], 0.0, moved[keep, n + 2]
    )


def _seen(record: Record, a: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Return how the state of a chain shows in an output; what a torque adds to an acceleration at once is left out."""
    h, is_load = np.zeros(a.shape[0]), record.location is Location.LOAD
    speed = h.size - 2 if is_load else 0
    if record.kind is OutputKind.TORQUE:
        h[:3] = values["c"], values["k"], -values["c"]
    elif record.kind is OutputKind.ACCELERATION:
        h[:] = a[speed]
    elif record.kind is OutputKind.POSITION:
        h[-1], h[1:-1:2] = 1.0, -float(is_load)  # behind the shafts less their twists
    else:
        h[speed] = 1.0
    return h


def _at_shaft(values: Mapping[str, float]) -> FloatArray:
    """Return how a torque more in the first shaft drives a chain: back on the motor, and on what is behind it."""
    inertias = [values[name] for name in ("J_M", "J_2", "J_L") if name in values]
    at_shaft = np.zeros(2 * len(inertias))
    if len(inertias) > 1:
        at_shaft[[0, 2]] = -1.0 / inertias[0], 1.0 / inertias[1]
    return at_shaft


def _continuous(values: dict[str, float]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return state matrix and inputs of a chain: speeds and twists in turn, last the motor's angle."""
    inertias = [values[name] for name in ("J_M", "J_2", "J_L") if name in values]
    springs = [(values[k], values[c]) for k, c in (("k", "c"), ("k_2", "c_2")) if k in values]
    viscous = [values["b_M"], *[0.0] * (len(inertias) - 2), *([values["b_L"]] if "b_L" in values else [])]
    n = 2 * len(inertias)
    a, at_motor, at_load = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    a[n - 1, 0] = 1.0
    for i, (inertia, b) in enumerate(zip(inertias, viscous, strict=True)):
        a[2 * i, 2 * i] -= b / inertia
    for i, (k, c) in enumerate(springs):
        left, twist, right = 2 * i, 2 * i + 1, 2 * i + 2
        a[twist, left], a[twist, right] = 1.0, -1.0
        for speed, sign, inertia in ((left, -1.0, inertias[i]), (right, 1.0, inertias[i + 1])):
            a[speed, [twist, left, right]] += sign / inertia * np.array([k, c, -c])
    at_motor[0] = 1.0 / inertias[0]
    at_load[n - 2] = -1.0 / inertias[-1]
    return a, at_motor, at_load


class FormPlace(IntEnum):
    """Where a law whose form is in error acts: on the motor, against the load, in the shaft."""

    MOTOR = 0
    LOAD = 1
    SHAFT = 2


def form_changes(result: FitResult, index: int) -> FloatArray:
    """Return by how much the laws at each place change around each sample of a recording [Nm], shape (3, N)."""
    return _of_laws(result, index, change_around)


def changes_of(result: FitResult) -> tuple[FloatArray, ...]:
    """Return how much laws change in each recording at each place, shape (3, N_i); nothing where none does."""
    each = tuple(form_changes(result, i) for i in range(len(result.problem.bases)))
    return each if any(change.any() for change in each) else ()


def form_shifts(result: FitResult, index: int) -> FloatArray:
    """Return what is missing at each place around a change of a law that comes late [Nm], shape (3, N)."""
    return _of_laws(result, index, change_across)


def _of_laws(result: FitResult, index: int, change_of: Callable[[FloatArray], FloatArray]) -> FloatArray:
    p, record = result.p_of(index), result.problem.records[index]
    found = np.zeros((len(FormPlace), record.time_s.size))
    structure = result.problem.grid.structure
    if structure is Structure.JOINT or result.problem.grid.plant is not None:
        return found
    motor, load = _has_dry_friction(p)
    if motor:
        found[FormPlace.MOTOR] = change_of(_at_motor(simulated(result, index, state=state_vector.SPEED), p))
    if load:
        state = state_vector.SPEED if structure is Structure.ONE_MASS else state_vector.LOAD_SPEED
        found[FormPlace.LOAD] = change_of(
            _at_load(simulated(result, index, state=state), record.since_start_s, record.sample_time_s, p)
        )
    if p[[slots.GAP, _STAGE]].any():
        found[FormPlace.SHAFT] = change_of(_in_shaft(simulated(result, index, state=state_vector.TWIST), p))
    return np.where(np.isfinite(found), found, 0.0)


@compiled
def _has_dry_friction(p: FloatArray) -> tuple[bool, bool]:
    return has_dry_friction_at_motor(p), has_dry_friction_at_load(p)


@compiled
def _at_motor(speed: FloatArray, p: FloatArray) -> FloatArray:
    torque = np.empty_like(speed)
    for k in range(speed.size):
        torque[k] = motor_sliding(speed[k], p) * np.sign(speed[k])
    return torque


@compiled
def _at_load(speed: FloatArray, since_start_s: FloatArray, period_s: float, p: FloatArray) -> FloatArray:
    torque = np.empty_like(speed)
    for k in range(speed.size):
        period = since_start_s[min(k, speed.size - 2)]  # behind the last sample there is none
        torque[k] = load_sliding(period, period_s, p) * np.sign(speed[k])
    return torque


def _in_shaft(twist: FloatArray, p: FloatArray) -> FloatArray:
    """Return what the shaft carries less than its spring would: up to half a gap's worth, and a stage's more."""
    half = 0.5 * p[slots.GAP]
    missing = np.clip(twist, -half, half)
    beyond = np.abs(twist) - half - p[_STAGE_FROM]
    more = p[_STAGE] * np.sign(twist) * np.maximum(beyond, 0.0)
    return p[slots.K] * (more - missing)


def change_around(law_nm: FloatArray) -> FloatArray:
    """Return the range of a torque over the samples around each one, shape (N,)."""
    padded = np.pad(law_nm, AROUND, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * AROUND + 1)
    return windows.max(axis=1) - windows.min(axis=1)


def change_across(law_nm: FloatArray) -> FloatArray:
    """Return the change of a torque from the first to the last of the samples around each one, shape (N,)."""
    padded = np.pad(law_nm, AROUND, mode="edge")
    return padded[2 * AROUND :] - padded[: law_nm.size]
