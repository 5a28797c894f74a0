"""What drives a line in a simulation: its torques and loads over time, and the state it starts from."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable, Sequence
from functools import partial
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from estimator.compiled import compiled, inlined
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.curve import MOST_KNOTS, VALUES, curve_over
from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.effect import Acting, Effect, Place
from estimator.physics.kernel import conditions, slots, state_vector
from estimator.physics.kernel.conditions import branch_frequency, branch_inertia, is_bristled, is_within
from estimator.physics.kernel.laws_at import load_lasting, motor_sliding, resolved
from estimator.physics.layout import LOAD, slot
from estimator.signals.record import MOST_BYTES, FloatArray, IntArray, Record, once

MOST_KEPT = 2  # torques that are kept: that of a fit, and one with something moved

_TABLE = range(slots.TABLE_TORQUE, slots.TABLE_TORQUE + VALUES + MOST_KNOTS)
"""Where a curve over the torque stands."""


class TorqueLaw(NamedTuple):
    """What an entry declares for the torque before it reaches the shaft."""

    acting: Acting  # the law
    at: list[int]  # where its parameters are
    sizes: list[int]  # where those are of which each does something by itself
    nulls: FloatArray  # at which values of these it does nothing
    begins: int  # where that is which its state begins with, if it has one

    def is_on(self, p: FloatArray) -> bool:
        """Tell whether it does anything."""
        return bool((p[self.sizes] != self.nulls).any())


def _declared(place: Place) -> list[TorqueLaw]:
    return [_law_of(e, e.acting) for e in BUILT_IN.values() if e.acting is not None and e.acting.place is place]


def _law_of(entry: Effect, acting: Acting) -> TorqueLaw:
    sizes = [each for each in entry.parameters if each.name in entry.sizes]
    return TorqueLaw(
        acting,
        [slot(entry.name, each.name) for each in entry.parameters],
        [slot(entry.name, each.name) for each in sizes],
        np.array([each.null for each in sizes]),
        next((slot(entry.name, each.name) for each in entry.parameters if each.outlasts), 0),
    )


OF_INVERTERS = _declared(Place.INVERTER)
OF_TORQUE = [law for law in _declared(Place.TORQUE) if law.acting.course is None]
WITH_COURSE = [law for law in _declared(Place.TORQUE) if law.acting.course is not None]
"""Laws of the torque in the order in which they act, behind those of each inverter and of their sum; between the two a
curve over the torque. The state of the last ones begins, in each recording, with the parameter that outlasts one."""

_PATH = np.array([*(place for law in (*OF_INVERTERS, *OF_TORQUE, *WITH_COURSE) for place in law.at), *_TABLE])
"""Where all stands that ``shaft_torque`` depends on."""


def begun_states(p: FloatArray) -> FloatArray:
    """Return the states of the torque's laws that have one as a recording begins, shape (M,)."""
    return np.array([p[law.begins] for law in WITH_COURSE])


def shaft_torque(torque_nm: FloatArray, since_start_s: FloatArray, p: FloatArray) -> FloatArray:
    """Return the torque on the motor shaft, shape (N,) [Nm], of a recording; see ``shaft_torque_from``."""
    period_s = float(since_start_s[1] - since_start_s[0]) if since_start_s.size > 1 else 0.0
    return shaft_torque_from(torque_nm, since_start_s, period_s, p, begun_states(p))[0]


def shaft_torque_from(
    torque_nm: FloatArray, since_start_s: FloatArray, period_s: float, p: FloatArray, begun: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the torque on the motor shaft, shape (N,) [Nm], and the states (M,) of its laws behind it."""
    torques, ended = list(torque_nm.T), begun.copy()
    on = [law for law in OF_INVERTERS if law.is_on(p)]
    for law in on:
        torques = [law.acting.law(torque, i, *p[law.at]) for i, torque in enumerate(torques)]
    total: FloatArray = functools.reduce(np.add, torques)
    for law in on:
        if law.acting.of_sum is not None:
            total = law.acting.of_sum(total, *p[law.at])
    for law in OF_TORQUE:
        if law.is_on(p):
            total = law.acting.law(total, since_start_s, *p[law.at])
    if p[slots.TABLE_TORQUE] > 0.0:
        total = total + curve_over(total, p, slots.TABLE_TORQUE)
    for i, law in enumerate(WITH_COURSE):
        if law.acting.course is not None and law.is_on(p):
            states = law.acting.course(total, since_start_s, period_s, begun[i], *p[law.at])
            total, ended[i] = law.acting.law(total, since_start_s, states[:-1], *p[law.at]), states[-1]
    return total, ended


class _Kept:
    """What the last torques of a recording were worked out from, and these: most simulations ask for one of them."""

    def __init__(self) -> None:
        self.torques: tuple[tuple[bytes, FloatArray], ...] = ()


@once
def _kept(record: Record) -> _Kept:
    return _Kept()


def recorded_shaft_torque(record: Record, p: FloatArray) -> FloatArray:
    """Return ``shaft_torque`` of a recording, which nobody may write to."""
    kept, key = _kept(record), path_of(p)
    for known, torque in kept.torques:
        if known == key:
            return torque
    torque = shaft_torque(record.torque_nm, record.since_start_s, p)
    if torque.nbytes <= MOST_BYTES:
        kept.torques = ((key, torque), *kept.torques)[:MOST_KEPT]
    return torque


def path_of(p: FloatArray) -> bytes:
    """Return what the torque on the shaft depends on: of most lines it is the same."""
    path: FloatArray = p[_PATH]
    return path.tobytes()


Key = TypeVar("Key", bound=Hashable)


class Inputs(NamedTuple):
    """What drives a line in each of K simulations."""

    torque: FloatArray  # (T, N): torque on its shaft and load torque, each that any of them has [Nm]
    load: FloatArray  # (T, N): torque on its shaft and load torque, each that any of them has [Nm]
    fed_by: IntArray  # (K,): which of these each has
    loaded_by: IntArray  # (K,): which of these each has
    p: FloatArray  # (K, layout.SIZE): parameters
    state: FloatArray  # (K, STATES): the kernel's start state, which a simulation overwrites


def inputs_of(records: Sequence[Record], of: Sequence[int], cases: Sequence[Case]) -> Inputs:
    """Return what drives cases of some recordings; the shorter ones continue under what they ended with."""
    size = max(record.time_s.size for record in records)
    torques, loads = _Rows[tuple[int, bytes]](size), _Rows[tuple[int, float, int]](size)
    for i, case in zip(of, cases, strict=True):
        record, start, extra_nm = records[i], case.start, case.extra_load_nm
        torques.add((i, path_of(case.p)), partial(recorded_shaft_torque, record, case.p))
        loads.add((i, start.load_torque_nm + _common(case), id(extra_nm)), partial(load_of, case, record))
    torque, fed_by = torques.found()
    load, loaded_by = loads.found()
    p, starts = np.array([case.p for case in cases]), [case.start for case in cases]
    return Inputs(torque, load, fed_by, loaded_by, p, initial_states(starts, torque[fed_by, 0], 0.0, p))


def load_of(case: Case, record: Record) -> FloatArray:
    """Return the load torque of a case over time, shape (N,) [Nm]."""
    extra_nm = 0.0 if case.extra_load_nm is None else case.extra_load_nm
    constant_nm = case.start.load_torque_nm + _common(case)
    return np.broadcast_to(constant_nm + extra_nm + record.known_load_nm, record.time_s.shape)


def _common(case: Case) -> float:
    """Return the constant load torque that is not the recording's own [Nm]."""
    return float(case.p[slot("", LOAD)])


class _Rows(Generic[Key]):
    """Rows of values by keys, of which most are met again."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._place = dict[Key, int]()
        self._rows = list[FloatArray]()
        self._chosen = list[int]()

    def add(self, key: Key, make: Callable[[], FloatArray]) -> None:
        """Add the values that belong to a key; they are made where it is met first."""
        place = self._place.setdefault(key, len(self._rows))
        if place == len(self._rows):
            self._rows.append(make())
        self._chosen.append(place)

    def found(self) -> tuple[FloatArray, IntArray]:
        """Return the rows, each as long as ``size`` and continuing as it ended, and which was added when."""
        rows = np.empty((len(self._rows), self._size))
        for row, values in zip(rows, self._rows, strict=True):
            row[: values.size], row[values.size :] = values, values[-1]
        return rows, np.array(self._chosen)


def initial_state(start: InitialCondition, torque_nm: float, angle_rad: float, p: FloatArray) -> FloatArray:
    """Return the kernel's state at the start: what is not unknown follows from the rest as if it were steady."""
    return initial_states([start], np.array([torque_nm]), angle_rad, p[np.newaxis])[0]


def initial_states(
    starts: Sequence[InitialCondition], torque_nm: FloatArray, angle_rad: float, p: FloatArray
) -> FloatArray:
    """Return ``initial_state`` of K simulations with these torques, (K,), and parameters, (K, layout.SIZE)."""
    states = np.zeros((len(starts), state_vector.STATES))
    for row, start in zip(states, starts, strict=True):
        row[state_vector.ANGLE] = start.angle_rad
        row[state_vector.SPEED] = start.speed_rad_s
        row[state_vector.TWIST] = start.twist_rad
        row[state_vector.LOAD_SPEED] = start.load_speed_rad_s
        row[state_vector.MIDDLE_TWIST] = start.middle_twist_rad
        row[state_vector.MIDDLE_SPEED] = start.middle_speed_rad_s
        row[state_vector.TRACTION] = start.load_torque_nm
    _follow(states, torque_nm, angle_rad, p)
    return states


@compiled
def _follow(states: FloatArray, torque_nm: FloatArray, angle_rad: float, p: FloatArray) -> None:
    """Fill in what follows from the rest, a row per simulation."""
    for row in range(states.shape[0]):
        follow(states[row], torque_nm[row], angle_rad, p[row])


@inlined
def follow(x: FloatArray, torque_nm: float, angle_rad: float, p: FloatArray) -> None:
    """Fill in what follows from the rest of a state, shape (STATES,)."""
    speed, carried = x[state_vector.SPEED], x[state_vector.LOAD_SPEED]
    x[state_vector.VEHICLE_SPEED] = carried
    x[state_vector.BRANCH_SPEED] = carried if p[slots.BEHIND] > 0.0 else speed
    if is_within(p):  # another spring of the line carries what the shaft does
        x[state_vector.BRANCH_TWIST] = (
            p[slots.K] * x[state_vector.TWIST] / (branch_inertia(p) * branch_frequency(p) ** 2)
        )
    x[state_vector.LAGGED] = torque_nm + p[slots.LAGGED_BEFORE]
    x[state_vector.LAG_RISE] = -p[slots.LAGGED_BEFORE]
    x[state_vector.FILTERED] = resolved(speed, angle_rad, p) + p[slots.FILTERED_BEFORE]
    x[state_vector.FILTER_RISE] = -p[slots.FILTERED_BEFORE]
    if is_bristled(p):  # of friction that has slid for long
        x[state_vector.BRISTLES_MOTOR] = conditions.slid(speed, motor_sliding(speed, p))
        loaded = carried if p[slots.J_L] > 0.0 else speed
        x[state_vector.BRISTLES_LOAD] = conditions.slid(loaded, load_lasting(0.0, 1.0, p))
