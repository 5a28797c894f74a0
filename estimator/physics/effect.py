"""What an entry of the catalogue is: a law that can be released from its null, and what is known of it.

A missing effect is a constraint of the superset model to release: at ``null`` its law does nothing. A law
that acts at one of the places of ``estimator.physics.effect`` is taken into the one kernel from its entry; one that
changes the line itself is written into the kernel. Everything else about it stands in its entry.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from estimator.physics.driveline import UNITS, Driveline, Motion, Structure, unit
from estimator.signals.record import OutputKind, Record


class Place(Enum):
    """Where a law acts, and so what it is given before its parameters, and what it returns.

    Those of a speed or an angle are compiled: for one simulation and for several side by side (``estimator.lanes``).

    Attributes
    ----------
    TORQUE
        ``law(torque, since_start_s, ...)``, arrays of shape (N,): reading of all inputs together [Nm] to the torque
        that acts.
    MOTOR, LOAD
        ``law(speed, ...)``: speed [rad/s] to the torque against a motion forward [Nm].
    LOAD_ANGLE
        ``law(angle, ...)``: simulated angle of the load [rad] to the torque against it [Nm].
    RECORDED_ANGLE
        The same of the motor's angle as recorded, from 0 at the start: where a simulated one would drift away.
    SHAFT_LOSS
        ``law(torque, sign, ...)``: torque of the shaft [Nm] and the sign of the load's speed, rounded at standstill, to
        what of it does not reach the load [Nm].
    """

    TORQUE = "torque"
    MOTOR = "motor"
    LOAD = "load"
    LOAD_ANGLE = "load_angle"
    RECORDED_ANGLE = "recorded_angle"
    SHAFT_LOSS = "shaft_loss"


@dataclass(frozen=True, slots=True)
class Acting:
    """A law at a place: it takes all parameters of its entry, in their order, behind what the place gives."""

    place: Place
    law: Callable[..., Any]


class Element(Enum):
    """Where in the chain from torque command to recorded sample an effect lives (CONTRACT)."""

    TORQUE_PATH = "torque_path"
    MOTOR = "motor"
    SHAFT = "shaft"
    LOAD = "load"
    SPEED_SENSOR = "speed_sensor"
    ACQUISITION = "acquisition"


EVERY_LINE = frozenset({Structure.ONE_MASS, Structure.TWO_MASS, Structure.THREE_MASS})
"""Structures with at least one inertia: every driveline."""

EVERY_STRUCTURE = frozenset(Structure)

WITH_SHAFT = frozenset({Structure.TWO_MASS, Structure.THREE_MASS})
"""Structures with a shaft between inertias."""

WITH_SPRING = WITH_SHAFT | {Structure.JOINT}
"""Structures with a shaft, between inertias or alone on a bench."""


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """One parameter of an effect's law.

    Attributes
    ----------
    name : str
        As in the model file, for example ``gap_rad``.
    dimension : str
        ``torque``, ``angle``, ``speed``, ``stiffness`` ... (translated to a unit by the kind of motion), or a unit.
    null : float
        The value at which the law does nothing.
    low, high : float
        Bounds of the fit, in multiples of the scale the effect's ``scales`` gives for the data at hand.
    meaning : str
        One line for people.
    optional : bool
        True where a model file may leave it out; it is then at ``null``.
    own : bool
        True where every recording has its own value (the phase of an angle, the moments of an event): it is estimated
        with the recording's initial state and belongs to no model.
    most : float
        Largest value that makes sense in a model, whatever the data: a share has no more than 1.
    form : str
        Name of the law's form where this parameter shapes it: of one that is not at its null.
    """

    name: str
    dimension: str
    null: float
    low: float
    high: float
    meaning: str
    optional: bool = False
    own: bool = False
    most: float = math.inf
    form: str = ""

    def unit(self, motion: Motion) -> str:
        """Return the parameter's unit in a kind of motion."""
        return unit(self.dimension, motion)


@dataclass(frozen=True, slots=True)
class Held:
    """A start value that the fit keeps: a discrete choice, such as the order of a ripple."""

    value: float


@dataclass(frozen=True, slots=True)
class Within:
    """A start value with bounds of its own, in scales: of a variant of the law that can't be followed everywhere."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Untestable:
    """Why a set of recordings can't tell whether an effect is there, and which test would.

    ``needs`` is what must be given next to any test; without it no recording can tell.
    """

    reason: str
    suggested_test: str
    needs: str = ""


Scales = Callable[[Driveline, Sequence[Record]], tuple[float, ...]]
Start = tuple[float | Held | Within, ...]


@dataclass(frozen=True, slots=True)
class Retelling:
    """Where a fit of a law that is written another way starts.

    Attributes
    ----------
    start : tuple
        Of the law's own parameters, in scales.
    line : mapping of str to float
        Of the line's own that change with it, by name, in their units.
    """

    start: Start
    line: Mapping[str, float]


Retold = Callable[[Driveline, Sequence[Record], Mapping[str, float], Mapping[str, float]], list[Retelling]]
Span = tuple[float, float]
Spans = Callable[[Driveline, Mapping[str, float], Mapping[str, float]], Mapping[str, tuple[Span, ...]]]
Starts = Callable[[Driveline, Sequence[Record]], list[Start]]
Testable = Callable[[Driveline, Sequence[Record]], Untestable | None]
Objection = Callable[[Driveline, Sequence[Record], Mapping[str, float]], str]


MOMENTS = (
    EffectParameter("from_s", "s", 0.0, 0.0, math.inf, "moment it begins: t_1, of each recording", True, True),
    EffectParameter("to_s", "s", 0.0, 0.0, math.inf, "moment it ends: t_2, of each recording", True, True),
)
"""Own parameters of an event: from when to when it acts, since the recording began."""


def long_enough(key: str) -> Callable[[Driveline, Sequence[Record], Mapping[str, float]], str]:
    """Return a check that a time is at least a tenth of the sampling period: shorter ones can't be reported."""

    def check(_model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
        least = 0.1 * min(record.sample_time_s for record in records)
        if values[key] >= least:
            return ""
        return f"{key} = {values[key]:.2g} s is less than a tenth of the sampling period"

    return check


@dataclass(frozen=True, slots=True)
class Step:
    """Which nominal parameter an event changes, and how: by its size, or by its size as a share.

    Attributes
    ----------
    of : callable
        Model to the parameter's name.
    relative : bool
    lasting : bool
        True where it does not go back within a recording.
    """

    of: Callable[[Driveline], str]
    relative: bool = False
    lasting: bool = False

    def turned(self, nominal: float, size: float) -> tuple[float, float]:
        """Return value and size of the same step expressed the other way round: changed is what was not."""
        after = nominal * (1.0 + size) if self.relative else nominal + size
        return after, nominal / after - 1.0 if self.relative else -size


@dataclass(frozen=True, slots=True)
class Effect:
    """An entry of the catalogue.

    Attributes
    ----------
    name, element
        As in the contract.
    title : str
        A few words for tables.
    law : str
        The equation, as text.
    source : str
        Where the law is from.
    excited_by : str
        What a test must do to show it.
    parameters : tuple[EffectParameter, ...]
    structures : frozenset[Structure]
        Where it makes sense.
    resembles : tuple[str, ...]
        Rivals that look alike in part: names of effects. In the catalogue it holds both ways.
    equivalent : tuple[str, ...]
        Effects that are the same linear system seen from torque and speed: no recording distinguishes them.
    contains : tuple[str, ...]
        Effects that are special cases of this one.
    acting : Acting or None
        The law and where it acts; None where it is a part of the equations (``estimator.physics.kernel``) or of the
        torque path.
    example : mapping of str to float
        Sizes that show on a bus of 2 kg m^2, 4000 Nm/rad and 40 to 100 kg m^2: for tests and pictures.
    scales : callable
        Model and records to a typical size of each parameter that all recordings share (positive).
    starts : callable
        Model and records to start points of the fit, in units of the scales, one value per parameter that all
        recordings share; ``Held`` values are not fitted, those ``Within`` bounds of their own stay there.
    testable : callable
        Model and records to None, or to the reason why they can't tell; by default any recording can.
    text : str or callable
        The statement a driveline engineer would write: a format string of the parameters, of times in ms, too
        (``time_constant_ms``), and of units (``unit[torque]``); or a function of the values and the kind of motion.
    kinds : frozenset[OutputKind]
        Measured outputs it makes sense with.
    profile : bool
        True where the parameters are a profile over each recording's own time (road grade) and not constants.
    event : bool
        True where it acts during an interval of each recording, from its own ``from_s`` to its own ``to_s``.
    step : Step or None
        Where the event is a step of a nominal parameter: of which.
    permanent : str
        The effect that the event is where it acts all along, if that is one.
    phases : mapping of str to str
        Own phase to the shared amplitude that it belongs to, for effects periodic in an angle.
    loosens : frozenset[str]
        Nominal parameters that it moves beyond what they are trusted to. Where one of them is at its bound the effect
        is fitted whatever a first look along its size promises: the look does not move them with it.
    described : callable
        Model, values of the effect and of the line to the spans in which a data sheet's value of a nominal parameter
        may lie, where the effect changes or splits what the parameter stands for: friction that warms is described
        somewhere between cold and warm.
    implausible : callable
        Model, records and parameter values to the reason why such values are no case of this effect, or "".
    unresolved : callable
        The same, to the reason why such values are too small to tell from another way of sampling, or "". Where such
        an effect explains most, nothing that explains less is named in its place.
    rescaled : callable
        Parameter values to the factors that parameters of the line take in the other way to tell the same motion, by
        their dimension; one that is not named stays as it is.
    completed : callable
        Values that were given to those a simulation should have: where leaving one out is simpler than any real part.
    retold : callable
        Model, records and fitted values, of the effect and of the line, to where fits of other ways to write the law
        start.
    derived : callable
        Parameter values, and the line's own, to those of parameters that are held but follow from the others.
    linear : bool
        True where a line is linear with it, or where it acts before the line or behind it: the simulation then takes
        its sub-steps as sums.
    waving : bool
        True where it changes the conditions of the motion all the time, by an angle or by the time.
    timed : bool
        True where the simulated line depends on the time since its recording began; an event does by itself.
    swinging : bool
        True where it makes sense for a load that swings only, and not for one that turns on and on.
    shows_start : frozenset[str]
        What else of a joint's start matters with it: ``twist``, ``preload``.
    recognised : bool
        True where it is recognised in the raw data before any fit (repeated, lost, quantised samples).
    """

    name: str
    element: Element
    title: str
    law: str
    source: str
    excited_by: str
    parameters: tuple[EffectParameter, ...]
    structures: frozenset[Structure]
    resembles: tuple[str, ...]
    text: str | Callable[[Mapping[str, float], Motion], str]
    equivalent: tuple[str, ...] = ()
    contains: tuple[str, ...] = ()
    acting: Acting | None = None
    example: Mapping[str, float] = field(default_factory=dict)
    scales: Scales = lambda _model, _records: (1.0,)
    starts: Starts = lambda _model, _records: []
    testable: Testable = lambda _model, _records: None
    kinds: frozenset[OutputKind] = frozenset(OutputKind)
    profile: bool = False
    event: bool = False
    step: Step | None = None
    permanent: str = ""
    phases: Mapping[str, str] = field(default_factory=dict)
    loosens: frozenset[str] = frozenset()
    described: Spans = lambda _model, _values, _line: {}
    implausible: Objection = lambda _model, _records, _values: ""
    unresolved: Objection = lambda _model, _records, _values: ""
    rescaled: Callable[[Mapping[str, float]], Mapping[str, float]] = lambda _values: {}
    completed: Callable[[Mapping[str, float]], Mapping[str, float]] = lambda values: values
    retold: Retold = lambda _model, _records, _values, _line: []
    derived: Callable[[Mapping[str, float], Mapping[str, float]], Mapping[str, float]] = lambda _values, _nominal: {}
    linear: bool = False
    waving: bool = False
    timed: bool = False
    swinging: bool = False
    shows_start: frozenset[str] = frozenset()
    recognised: bool = False

    @property
    def lasting(self) -> bool:
        """Whether it is a step that does not go back within a recording."""
        return self.step is not None and self.step.lasting

    def sentence(self, values: Mapping[str, float], motion: Motion) -> str:
        """Return what was found, as a statement."""
        if not isinstance(self.text, str):
            return self.text(values, motion)
        times_ms = {name.removesuffix("_s") + "_ms": 1e3 * value for name, value in values.items()}
        return self.text.format(**{**times_ms, **values}, unit=UNITS[motion])

    def form(self, values: Mapping[str, float]) -> str:
        """Return the name of the law's form at some values; "" where it has no other one, or is in its plain one."""
        shaped = (each for each in self.parameters if each.form and values.get(each.name, each.null) != each.null)
        return next((each.form for each in shaped), "")

    @property
    def shared_parameters(self) -> tuple[EffectParameter, ...]:
        """Parameters that all recordings share, in order."""
        return tuple(parameter for parameter in self.parameters if not parameter.own)

    @property
    def own_parameters(self) -> tuple[EffectParameter, ...]:
        """Parameters that every recording has of its own, in order."""
        return tuple(parameter for parameter in self.parameters if parameter.own)
