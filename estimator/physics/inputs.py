"""What drives a line in a simulation: its torques and loads over time, and the state it starts from."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import partial
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from estimator.compiled import compiled, inlined
from estimator.physics.kernel import bristles, sensing, slots, state_vector
from estimator.physics.kernel.conditions import branch_frequency, branch_inertia
from estimator.physics.kernel.line import is_bristled, is_within
from estimator.physics.layout import LOAD, slot
from estimator.physics.start import Case, Start
from estimator.physics.torque_path import path_of, recorded_shaft_torque
from estimator.signals.record import FloatArray, IntArray, Record

Key = TypeVar("Key", bound=Hashable)


class Inputs(NamedTuple):
    """What drives a line in each of K simulations.

    Attributes
    ----------
    torque, load : ndarray, shape (T, N) and (L, N)
        Torque on its shaft and load torque, each that any of them has [Nm].
    fed_by, loaded_by : ndarray of int, shape (K,)
        Which of these each has: most have the same.
    p : ndarray, shape (K, layout.SIZE)
        Parameters.
    state : ndarray, shape (K, STATES)
        The kernel's start state, which a simulation overwrites.
    """

    torque: FloatArray
    load: FloatArray
    fed_by: IntArray
    loaded_by: IntArray
    p: FloatArray
    state: FloatArray


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


def initial_state(start: Start, torque_nm: float, angle_rad: float, p: FloatArray) -> FloatArray:
    """Return the kernel's state at the start: what is not unknown follows from the rest as if it were steady."""
    only: FloatArray = initial_states([start], np.array([torque_nm]), angle_rad, p[np.newaxis])[0]
    return only


def initial_states(starts: Sequence[Start], torque_nm: FloatArray, angle_rad: float, p: FloatArray) -> FloatArray:
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
    x[state_vector.FILTERED] = sensing.reading(speed, angle_rad, p) + p[slots.FILTERED_BEFORE]
    x[state_vector.FILTER_RISE] = -p[slots.FILTERED_BEFORE]
    if is_bristled(p):  # of friction that has slid for long
        x[state_vector.BRISTLES_MOTOR] = bristles.slid(speed, bristles.sliding(speed, p))
        loaded = carried if p[slots.J_L] > 0.0 else speed
        x[state_vector.BRISTLES_LOAD] = bristles.slid(loaded, p[slots.COULOMB_LOAD])
