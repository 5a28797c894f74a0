"""A user's own law: a Python function that takes part in a diagnosis like an entry of the catalogue."""

from __future__ import annotations

import ctypes
import dis
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numba
import numpy as np

from estimator.compiled import IS_COMPILED
from estimator.errors import BadModel
from estimator.lanes.types import types
from estimator.physics.driveline import Motion
from estimator.physics.effect import EVERY_LINE, WITH_SHAFT, Effect, EffectParameter, Element
from estimator.signals.record import FloatArray

ARGUMENTS = ("time_s", "motor_speed", "load_speed", "twist", "torque")
"""What every law is given, in this order; its parameters follow by name."""

STRUCTURES = {
    Element.MOTOR: EVERY_LINE,
    Element.SHAFT: WITH_SHAFT,
    Element.LOAD: WITH_SHAFT,
    Element.SPEED_SENSOR: EVERY_LINE,
}
"""Where a law may act, and which structures have that place."""

TRIAL = np.array([[0.0, 0.5, 1.0], [-2.0, 0.0, 3.0], [-1.0, 0.0, 2.0], [-0.01, 0.0, 0.02], [-5.0, 0.0, 7.0]])
"""Arguments on which a law is tried before it is used: both signs and standstill; shape (5, 3)."""

SIGNATURE = types.UniTuple(types.float64, 2)(
    types.float64, types.float64, types.float64, types.float64, types.float64, types.Array(types.float64, 1, "C")
)
"""Arguments of every law and the parameter vector to the torque on the motor and the one against the load."""

BACK = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_double] * 5, ctypes.c_void_p)

FORCES = {Element.MOTOR: (-1.0, 0.0), Element.SHAFT: (-1.0, -1.0), Element.LOAD: (0.0, 1.0)}
"""Torque on the motor and torque against the load per unit of a law's torque; other laws act on the reading."""


@dataclass(frozen=True, slots=True)
class OwnParameter:
    """A parameter of a user's law, in its unit: where it does nothing, its bounds, and where a fit starts."""

    name: str  # as the function has it
    unit: str  # as text, for tables
    null: float  # value at which the law does nothing
    low: float  # bounds of a fit
    high: float  # inf where there is none
    start: float  # of a fit

    @property
    def scale(self) -> float:
        """Typical size of the parameter."""
        return max(abs(self.start), abs(self.null), 1e-3 * max(abs(self.low), abs(self.high)))


@dataclass(frozen=True, slots=True)
class OwnLaw:
    """A law by its function."""

    name: str  # of its own
    function: Callable[..., object]  # of ARGUMENTS, then its parameters by name; returns a torque [Nm]
    element: Element  # motor or load
    parameters: tuple[OwnParameter, ...]  # the first one decides
    label: str = ""  # how it was named, for messages
    takes_arrays: bool = field(init=False, default=False)  # whether it can be called with arrays
    compiled: Callable[..., float] | None = field(init=False, default=None)  # by numba; None where that is not possible

    def __post_init__(self) -> None:
        problems = self._problems()
        if problems:
            raise BadModel("\n".join(f"laws.{self.name}.{problem}" for problem in problems))
        self._try_out()

    def _problems(self) -> list[str]:
        problems = []
        if self.element not in STRUCTURES:
            places = ", ".join(element.value for element in STRUCTURES)
            problems.append(f"element: expected one of {places}, got {self.element.value}")
        if not self.parameters:
            problems.append("parameters: expected at least one, got none")
        for p in self.parameters:
            if not all(map(math.isfinite, (p.null, p.low, p.high, p.start))):
                problems.append(f"parameters.{p.name}: expected finite numbers for null, low, high and start")
            elif not (p.low < p.high and p.low <= p.start <= p.high):
                problems.append(f"parameters.{p.name}: expected low <= start <= high and low < high, got {p}")
        first = self.parameters[0] if self.parameters else None
        if first is not None and (first.start == first.null or not first.low <= first.null <= first.high):
            problems.append(
                f"parameters.{first.name}: expected a null inside its bounds and a start other than it, got {first}"
            )
        return problems

    def _try_out(self) -> None:
        """Call the function: it must take its arguments, return finite numbers, and do nothing at its null."""
        starts = {p.name: p.start for p in self.parameters}
        try:
            inspect.signature(self.function).bind(*ARGUMENTS, **starts)
        except TypeError as error:
            expected = f"({', '.join([*ARGUMENTS, *starts])})"
            raise BadModel(
                f"{self._where}: expected a function of {expected}, got one that does not fit: {error}"
            ) from error
        self(TRIAL, starts)
        object.__setattr__(self, "takes_arrays", self._same_of_arrays(starts))
        object.__setattr__(self, "compiled", self._compiled(starts))
        first = self.parameters[0]
        idle = self(TRIAL, starts | {first.name: first.null})
        if np.any(idle != 0.0):
            got = idle[idle != 0.0][0]
            raise BadModel(
                f"{self._where}: expected 0 where {first.name} is {first.null:g} (its null), got {got:g}. "
                "Put first the parameter that switches the law off, and give its null."
            )

    @property
    def _where(self) -> str:
        return f"laws.{self.name}.function {self.label}".rstrip()

    def __call__(self, arguments: FloatArray, values: Mapping[str, float]) -> FloatArray:
        """Return the law over arguments of shape (5, N), in the order of ``ARGUMENTS``; shape (N,).

        A function of numbers, which arrays make fail or mean something else, is called once for each column.
        """
        try:
            with np.errstate(all="ignore"):
                found = self._called(arguments, values)
        except Exception as error:  # whatever a user's function may raise is reported as its own
            raise BadModel(f"{self._where}: failed with {type(error).__name__}: {error}") from error
        bad = ~np.isfinite(found) & np.isfinite(arguments).all(axis=0)
        if bad.any():
            at = dict(zip(ARGUMENTS, arguments[:, bad][:, 0].tolist(), strict=True)) | dict(values)
            listed = ", ".join(f"{name} = {value:g}" for name, value in at.items())
            raise BadModel(f"{self._where}: expected a finite number, got {found[bad][0]:g} at {listed}")
        return found

    def _same_of_arrays(self, values: Mapping[str, float]) -> bool:
        try:
            with np.errstate(all="ignore"):
                together = np.asarray(self.function(*TRIAL, **values), dtype=float)
        except Exception:  # noqa: BLE001  # a function of numbers may fail on arrays in any way: it is called one by one
            return False
        return together.shape in ((), TRIAL.shape[1:]) and bool(np.all(together == self._one_by_one(TRIAL, values)))

    @property
    def parameter_names(self) -> list[str]:
        """Names of the function's own parameters."""
        return list(inspect.signature(self.function).parameters)[len(ARGUMENTS) :]

    def at(
        self, time_s: float, motor: float, load: float, twist: float, torque: float, values: Mapping[str, float]
    ) -> float:
        """Return the law of one moment; see ``__call__``, which says what is wrong where something is."""
        with suppress(Exception):
            found = float(self.function(time_s, motor, load, twist, torque, **values))  # type: ignore[arg-type]
            if math.isfinite(found):
                return found
        return float(self(np.array([[time_s], [motor], [load], [twist], [torque]]), values)[0])

    def _compiled(self, values: Mapping[str, float]) -> Callable[..., float] | None:
        """Return the function compiled; None where it can't be, raises by itself, or returns something else then."""
        try:
            if any(each.opname == "RAISE_VARARGS" for each in dis.get_instructions(self.function)):
                return None
            law: Any = numba.njit(error_model="numpy")(self.function)
            found = [
                law(*column, *(float(values[name]) for name in self.parameter_names)) for column in TRIAL.T.tolist()
            ]
        except Exception:  # noqa: BLE001  # a compiler refuses a function in any way: it is called as it is
            return None
        return law if np.array_equal(found, self._one_by_one(TRIAL, values)) else None

    def _called(self, arguments: FloatArray, values: Mapping[str, float]) -> FloatArray:
        if self.takes_arrays:
            returned = np.asarray(self.function(*arguments, **values), dtype=np.float64)
            return np.broadcast_to(returned, arguments.shape[1:])
        return self._one_by_one(arguments, values)

    def _one_by_one(self, arguments: FloatArray, values: Mapping[str, float]) -> FloatArray:
        return np.array([float(self.function(*column, **values)) for column in arguments.T.tolist()])  # type: ignore[arg-type]

    def effect(self) -> Effect:
        """Return the law as an entry of the catalogue."""
        title = self.name.replace("_", " ")

        def sentence(values: Mapping[str, float], motion: Motion) -> str:
            sizes = ", ".join(f"{p.name} = {values[p.name]:.3g} {p.unit}".rstrip() for p in self.parameters)
            return f"the law {self.name} acts at the {title_of(self.element)} ({sizes})"

        return Effect(
            name=self.name,
            element=self.element,
            title=title,
            law=f"Python function {self.label}".rstrip(),
            source="the model file",
            excited_by="what its function is of",
            parameters=tuple(
                EffectParameter(p.name, p.unit, p.null, p.low / p.scale, p.high / p.scale, "parameter of the function")
                for p in self.parameters
            ),
            structures=STRUCTURES[self.element],
            resembles=(),
            scales=lambda model, records: tuple(p.scale for p in self.parameters),
            starts=lambda model, records: [tuple(p.start / p.scale for p in self.parameters)],
            testable=lambda model, records: None,
            text=sentence,
        )


def title_of(element: Element) -> str:
    """Return the words for a place."""
    return element.value.replace("_", " ")


class LawName(str):
    """The name of a law of one model; as a text it is like any other."""

    law: OwnLaw
    entry: Effect  # the law as an entry of the catalogue
    places: Mapping[str, int]
    compiled: dict[tuple[LawName, ...], Forces]

    def is_active(self, p: FloatArray) -> bool:
        """Tell whether the law's first parameter is off its null in the kernel's vector."""
        first = self.law.parameters[0]
        return bool(p[self.places[first.name]] != first.null)

    def ordered_places(self) -> list[int]:
        """Return where the parameters stand in the order in which the law's function takes them."""
        return [self.places[name] for name in self.law.parameter_names]

    def values(self, p: FloatArray) -> dict[str, float]:
        """Return the law's parameters from the parameter vector."""
        return {name: float(p[place]) for name, place in self.places.items()}


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

        return numba.njit(called)


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

    def torques(time_s, motor, load, twist, torque, p):  # type: ignore[no-untyped-def]
        first, second = before(time_s, motor, load, twist, torque, p)
        law_nm = law(time_s, motor, load, twist, torque, p)
        return first + on_motor * law_nm, second + on_load * law_nm

    return numba.njit(torques)
