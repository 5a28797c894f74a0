"""A user's own law: a Python function that takes part in a diagnosis like an entry of the catalogue.

It is given what happens in the line and returns a torque, or an error of the reading; the compiled simulation calls it
(``estimator.physics.own_forces``).
"""

from __future__ import annotations

import dis
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numba
import numpy as np

from estimator.errors import BadModel
from estimator.physics import catalogue, layout
from estimator.physics.effect import EVERY_LINE, WITH_SHAFT, Effect, EffectParameter, Element
from estimator.physics.law_name import LawName
from estimator.physics.model import Motion
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


@dataclass(frozen=True, slots=True)
class OwnParameter:
    """A parameter of a user's law, in its unit: where it does nothing, its bounds, and where a fit starts."""

    name: str
    unit: str
    null: float
    low: float
    high: float
    start: float

    @property
    def scale(self) -> float:
        """Typical size of the parameter."""
        return max(abs(self.start), abs(self.null), 1e-3 * max(abs(self.low), abs(self.high)))


@dataclass(frozen=True, slots=True)
class OwnLaw:
    """A law by its function.

    Attributes
    ----------
    name : str
        Of its own: not one of the catalogue's.
    function : callable
        ``function(time_s, motor_speed, load_speed, twist, torque, **parameters)``, of numbers or of arrays of one
        shape: time since the recording began [s], speeds [rad/s], twist [rad] and torque reading [Nm] to a torque [Nm]
        or, at the sensor, an error of the reading. At the null of its first parameter it returns 0.
    element : Element
        Motor or load: the torque acts against positive motion. Shaft: it is carried next to spring and damper. Speed
        sensor: it is added to the reading.
    parameters : tuple of OwnParameter
        The first one decides: its interval must exclude its null for the law to be believed.
    label : str
        How it was named, for messages.

    Raises
    ------
    BadModel
        With every fault of the definition, one per line; or where the function can't be used.
    """

    name: str
    function: Callable[..., object]
    element: Element
    parameters: tuple[OwnParameter, ...]
    label: str = ""
    takes_arrays: bool = field(init=False, default=False)
    compiled: Callable[..., float] | None = field(init=False, default=None)

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

        Raises
        ------
        BadModel
            Where it fails, or returns what is no finite number for finite arguments.
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
        """Tell whether the function returns the same of arrays as of their numbers one by one."""
        try:
            with np.errstate(all="ignore"):
                together = np.asarray(self.function(*TRIAL, **values), dtype=float)
        except Exception:  # noqa: BLE001  # a function of numbers may fail on arrays in any way: it is called one by one
            return False
        return together.shape in ((), TRIAL.shape[1:]) and bool(np.all(together == self._one_by_one(TRIAL, values)))

    @property
    def taken(self) -> list[str]:
        """The parameters in the order in which the function takes them behind its arguments."""
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
            found = [law(*column, *(float(values[name]) for name in self.taken)) for column in TRIAL.T.tolist()]
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
            sentence=sentence,
        )


def title_of(element: Element) -> str:
    """Return the words for a place."""
    return element.value.replace("_", " ")


def named(laws: Sequence[OwnLaw]) -> tuple[LawName, ...]:
    """Return the names of the laws of one model, which know the laws and their places in its parameter vector.

    Raises
    ------
    BadModel
        Where a name is taken.
    """
    names = [law.name for law in laws]
    taken = [name for name in names if name in catalogue.BUILT_IN or names.count(name) > 1]
    if taken:
        raise BadModel(f"laws.{taken[0]}: expected a name that is not in the catalogue and comes once. Rename it.")
    found, size = [], layout.SIZE
    for law in laws:
        name = LawName(law.name)
        name.law, name.entry = law, replace(law.effect(), name=name)
        name.compiled = {}
        name.places = {each.name: size + i for i, each in enumerate(law.parameters)}
        size += len(law.parameters)
        found.append(name)
    return tuple(found)
