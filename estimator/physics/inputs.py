"""What drives a line in a simulation: its torques and loads over time, and the state it starts from."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from estimator.physics.layout import LOAD, slot
from estimator.physics.start import Start, initial_states
from estimator.physics.torque_path import path_of, recorded_shaft_torque
from estimator.signals.record import FloatArray, IntArray, Record

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True, slots=True)
class Case:
    """One simulation of a recording.

    Attributes
    ----------
    p : ndarray, shape (layout.SIZE,)
        Parameters of the superset model, the recording's own among them.
    extra_load_nm : ndarray, shape (N,), optional
        Load torque over time, next to the constant one.
    """

    p: FloatArray
    start: Start
    extra_load_nm: FloatArray | None = None


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
