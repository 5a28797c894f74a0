"""The laws of a user's own as one function that the compiled simulation calls by its address.

A law that numba can compile acts as one of the catalogue does, at each stage of each integration step. One that it
can't is called back in Python.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Sequence
from typing import Any

import numba

from estimator.compiled import IS_COMPILED
from estimator.lanes.tools import types
from estimator.physics.effect import Element
from estimator.physics.law_name import LawName

SIGNATURE = types.UniTuple(types.float64, 2)(
    types.float64, types.float64, types.float64, types.float64, types.float64, types.Array(types.float64, 1, "C")
)
"""Arguments of every law and the parameter vector to the torque on the motor and the one against the load."""

BACK = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_double] * 5, ctypes.c_void_p)

FORCES = {Element.MOTOR: (-1.0, 0.0), Element.SHAFT: (-1.0, -1.0), Element.LOAD: (0.0, 1.0)}
"""Torque on the motor and torque against the load per unit of a law's torque; other laws act on the reading."""

Function = Callable[..., Any]


class Forces(types.WrapperAddressProtocol):  # type: ignore[misc]  # numba has no types
    """The torques of some laws together, by the address of their compiled function."""

    def __init__(self, laws: Sequence[LawName]) -> None:
        self._fault: BaseException | None = None
        self._kept: list[object] = []  # callbacks live as long as what calls them
        forces = numba.njit(_none)
        for law in laws:
            forces = _with(forces, self._bound(law), *FORCES[law.law.element])
        self._forces = forces
        self._compiled = numba.cfunc(SIGNATURE)(forces.py_func) if IS_COMPILED else None

    def __call__(self, *given: Any) -> tuple[float, float]:
        """Return the torques where the simulation is run by Python."""
        torques: tuple[float, float] = self._forces(*given)
        return torques

    def __wrapper_address__(self) -> int:
        compiled: Any = self._compiled
        return int(compiled.address)

    def finish(self) -> None:
        """Raise what a law has raised in a simulation that is over; its torque was no number there."""
        fault, self._fault = self._fault, None
        if fault is not None:
            raise fault

    def signature(self) -> Any:
        """Return numba's signature of the function."""
        return SIGNATURE

    def _bound(self, law: LawName) -> Function:
        """Return a law as a function of its arguments and the parameter vector."""
        if law.law.compiled is None:
            return self._called_back(law)
        bound: Function = _first(law.law.compiled)
        for place in law.ordered_places():
            bound = _with_value(bound, place)
        return bound

    def _called_back(self, law: LawName) -> Function:
        """Return a law that is called in Python; its fault is kept, since none can pass through compiled code."""
        names, places = list(law.places), list(law.places.values())

        def call(time_s: float, motor: float, load: float, twist: float, torque: float, address: int) -> float:
            values = (ctypes.c_double * (max(places) + 1)).from_address(address)
            try:
                given = {name: values[place] for name, place in zip(names, places, strict=True)}
                return law.law.at(time_s, motor, load, twist, torque, given)
            except BaseException as fault:  # noqa: BLE001  # raised once the simulation is over
                self._fault = self._fault or fault
                return math.nan

        if not IS_COMPILED:
            return lambda time_s, motor, load, twist, torque, p: call(time_s, motor, load, twist, torque, p.ctypes.data)
        back = BACK(call)
        self._kept.append(back)

        def called(time_s, motor, load, twist, torque, p):  # type: ignore[no-untyped-def]
            return back(time_s, motor, load, twist, torque, p.ctypes)

        return numba.njit(called)  # type: ignore[no-any-return]


def _none(time_s, motor, load, twist, torque, p):  # type: ignore[no-untyped-def]
    return 0.0, 0.0


def _first(law: Function) -> Any:
    """Return a compiled law as a function of its arguments, a parameter vector and its values."""

    def first(time_s, motor, load, twist, torque, p, *values):  # type: ignore[no-untyped-def]
        return law(time_s, motor, load, twist, torque, *values)

    return numba.njit(first)


def _with_value(law: Function, place: int) -> Any:
    """Return the same with its next value from the parameter vector."""

    def with_value(time_s, motor, load, twist, torque, p, *values):  # type: ignore[no-untyped-def]
        return law(time_s, motor, load, twist, torque, p, p[place], *values)

    return numba.njit(with_value)


def _with(before: Function, law: Function, on_motor: float, on_load: float) -> Any:
    """Return torques with those of one more law."""

    def torques(time_s, motor, load, twist, torque, p):  # type: ignore[no-untyped-def]
        first, second = before(time_s, motor, load, twist, torque, p)
        law_nm = law(time_s, motor, load, twist, torque, p)
        return first + on_motor * law_nm, second + on_load * law_nm

    return numba.njit(torques)
