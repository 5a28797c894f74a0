"""What an entry of the catalogue is: a law that can be released from its null, and what is known of it.

A missing effect is a constraint of the superset model to release: at ``null`` its law does nothing. A law
that acts at a `Place` is taken into the one kernel from its entry. Written into the kernel is what gives the line
another mass, has faces that meet, or comes between the samples, and how dry friction is near rest. Everything else
about a law stands in its entry.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

from estimator.physics.driveline import UNITS, Driveline, Motion, Structure, unit
from estimator.signals.record import OutputKind, Record

EVERY_LINE = frozenset({Structure.ONE_MASS, Structure.TWO_MASS, Structure.THREE_MASS})
"""Structures with at least one inertia: every driveline."""

EVERY_STRUCTURE = frozenset(Structure)

WITH_SHAFT = frozenset({Structure.TWO_MASS, Structure.THREE_MASS})  # structures with a shaft between inertias
WITH_SPRING = WITH_SHAFT | {Structure.JOINT}  # structures with a shaft, between inertias or alone on a bench


class Place(Enum):
    """Where a law acts, and so what it is given before its parameters, and what it returns.

    All but those of the recorded torques are compiled: for one simulation and, but for `SENSOR`, for several side by
    side (``estimator.lanes``). Where several laws act at one place their torques add up; a law that is given a value of
    the line, a twist or a reading returns what it makes of it, and the next one takes that. Torques in Nm, angles in
    rad, speeds in rad/s; a time is that since the start at which a step begins, and a length the step's [s].
    """

    INVERTER = "inverter"  # recorded torque of one inverter, its number from 0 on -> torque that acts
    TORQUE = "torque"  # torque of all inverters and time since the start, (N,) each -> torque that acts
    DRIVE_ANGLE = "drive_angle"  # recorded angle of the motor -> torque at the motor, share of the drive's own torque
    MOTOR = "motor"  # speed -> torque against the motion
    MOTOR_DRY = "motor_dry"  # speed -> size of a dry friction that slides: even in the speed, largest at rest
    MOTOR_INERTIA = "motor_inertia"  # inertia [kg m^2], time, length -> inertia
    CARDAN = "cardan"  # recorded angle of the motor -> torque, share of the shaft's, imposed angle, its slope [rad/rad]
    STIFFNESS = "stiffness"  # stiffness of the first shaft [Nm/rad], time, length -> stiffness
    SPRING = "spring"  # twist of the first shaft -> twist at which a linear spring carries the same torque
    SHAFT = "shaft"  # twist, its rate -> torque; its laws have a state
    SHAFT_LOSS = "shaft_loss"  # torque of the shaft, direction of the motion -> torque that is lost
    LOAD = "load"  # speed -> torque against the motion
    LOAD_DRY = "load_dry"  # time, length -> size of a dry friction
    LOAD_DAMPING = "load_damping"  # viscous friction [Nm s/rad], time, length -> viscous friction
    LOAD_INERTIA = "load_inertia"  # inertia of the load, or of a line of one mass [kg m^2], time, length -> inertia
    LOAD_ANGLE = "load_angle"  # angle of the load -> torque against it
    RECORDED_ANGLE = "recorded_angle"  # recorded angle of the motor -> torque against the load
    RESOLVER = "resolver"  # speed, angle that is read -> speed that is read
    SENSOR = "sensor"  # reading -> what is recorded of it


class Around(NamedTuple):
    """What a law with a state is given of the line that it is in."""

    stiffness: float  # of the first shaft [Nm/rad]
    fastest: float  # decay that the step can follow [1/s]
    stiffest: float  # spring that the step can follow [Nm/rad]


@dataclass(frozen=True, slots=True)
class Acting:
    """A law at a place: it takes all parameters of its entry, in their order, behind what the place gives.

    One with a state gives the state's rate, too: both functions then get, between the two, the state and an `Around`.
    The state is 0 where a simulation begins.
    """

    place: Place  # where along the line
    law: Callable[..., Any]  # compiled; returns a torque [Nm] or what the place says
    rate: Callable[..., Any] | None = None  # compiled; returns the rate of the law's state [1/s times its unit]
    of_sum: Callable[..., Any] | None = None  # of an inverter's law: torque of all -> torque that acts
    course: Callable[..., Any] | None = None
    """Of a law of the torque with a state, which it is given behind the time: torque and time since the start, (N,)
    each, the sampling period and the state that it begins with -> its states and the one behind the last, (N + 1,). It
    begins with the parameter that outlasts a recording."""


class Element(Enum):
    """Where in the chain from torque command to recorded sample an effect lives (CONTRACT)."""

    TORQUE_PATH = "torque_path"
    MOTOR = "motor"
    SHAFT = "shaft"
    LOAD = "load"
    SPEED_SENSOR = "speed_sensor"
    ACQUISITION = "acquisition"


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """One parameter of an effect's law."""

    name: str  # as in the model file, for example ``gap_rad``
    dimension: str  # such as "torque": its unit follows from the kind of motion
    null: float  # the value at which the law does nothing
    low: float  # bounds of a fit, in the parameter's scale
    high: float  # inf where there is none
    meaning: str  # one line for people
    optional: bool = False  # true where a model file may leave it out
    own: bool = False  # true where each recording has its own value, which no model file holds
    least: float = -math.inf  # smallest value that makes sense in a model, whatever the data
    most: float = math.inf  # largest such value
    form: str = ""  # name of the law's form where this parameter shapes it
    outlasts: bool = False  # true of an own one that continues from one recording to the next: none before the first

    def unit(self, motion: Motion) -> str:
        """Return the parameter's unit in a kind of motion."""
        return unit(self.dimension, motion)


@dataclass(frozen=True, slots=True)
class Held:
    """A start value that the fit keeps: a discrete choice, such as the order of a ripple."""

    value: float  # in the parameter's scale


@dataclass(frozen=True, slots=True)
class Within:
    """A start value with bounds of its own, in scales: of a variant of the law that can't be followed everywhere."""

    value: float  # start, in the parameter's scale
    low: float  # lowest value of the fit
    high: float  # highest


@dataclass(frozen=True, slots=True)
class Untestable:
    """Why a set of recordings can't tell whether an effect is there, and which test would.

    ``needs`` is what must be given next to any test; without it no recording can tell.
    """

    reason: str  # why not, as part of a sentence
    suggested_test: str  # kind of experiment that would show it
    needs: str = ""


Scales = Callable[[Driveline, Sequence[Record]], tuple[float, ...]]
FitStart = tuple[float | Held | Within, ...]


@dataclass(frozen=True, slots=True)
class OtherForm:
    """Where a fit of a law that is written another way starts."""

    start: FitStart  # of the law's own parameters, in scales
    line: Mapping[str, float]  # of the line's own that change with it, by name, in their units


OtherForms = Callable[[Driveline, Sequence[Record], Mapping[str, float], Mapping[str, float]], list[OtherForm]]
Span = tuple[float, float]
Spans = Callable[[Driveline, Mapping[str, float], Mapping[str, float]], Mapping[str, tuple[Span, ...]]]
Starts = Callable[[Driveline, Sequence[Record]], list[FitStart]]
Testable = Callable[[Driveline, Sequence[Record]], Untestable | None]
Objection = Callable[[Driveline, Sequence[Record], Mapping[str, float]], str]


MOMENTS = (
    EffectParameter("from_s", "s", 0.0, 0.0, math.inf, "moment it begins: t_1, of each recording", True, True),
    EffectParameter("to_s", "s", 0.0, 0.0, math.inf, "moment it ends: t_2, of each recording", True, True),
)
"""Own parameters of an event: from when to when it acts, since the recording began."""


def long_enough(key: str) -> Callable[[Driveline, Sequence[Record], Mapping[str, float]], str]:
    """Return the objection to a time constant or delay below a tenth of the sampling period."""

    def check(_model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
        least = 0.1 * min(record.sample_time_s for record in records)
        if values[key] >= least:
            return ""
        return f"{key} = {values[key]:.2g} s is less than a tenth of the sampling period"

    return check


@dataclass(frozen=True, slots=True)
class Step:
    """Which nominal parameter an event changes, and how: by its size, or by its size as a share."""

    of: Callable[[Driveline], str]  # model to the parameter's name
    relative: bool = False  # true where the size is a share of the nominal value
    lasting: bool = False  # true where it does not go back within a recording

    def turned(self, nominal: float, size: float) -> tuple[float, float]:
        """Return value and size of the same step expressed the other way round: changed is what was not."""
        after = nominal * (1.0 + size) if self.relative else nominal + size
        return after, nominal / after - 1.0 if self.relative else -size


@dataclass(frozen=True, slots=True)
class Effect:
    """An entry of the catalogue."""

    name: str  # as in the contract
    element: Element  # where along the chain from torque command to recorded sample
    title: str  # A few words for tables
    law: str  # the equation, as text
    source: str  # where the law is from
    excited_by: str  # what a test must do to show it
    parameters: tuple[EffectParameter, ...]  # in the order in which the law takes them; the first is a size
    structures: frozenset[Structure]  # where it makes sense
    resembles: tuple[str, ...]  # rivals that look alike in part
    text: str | Callable[[Mapping[str, float], Motion], str]  # the statement a driveline engineer would write
    equivalent: tuple[str, ...] = ()  # effects that are the same linear system seen from torque and speed
    contains: tuple[str, ...] = ()  # effects that are special cases of this one
    acting: Acting | None = None  # the law and where it acts
    example: Mapping[str, float] = field(default_factory=dict)
    """Values for `hil sim` and pictures, in the parameters' units."""
    scales: Scales = lambda _model, _records: (1.0,)
    """Typical size of the parameters in these recordings, in their units."""
    starts: Starts = lambda _model, _records: []  # where fits start, in scales; none of what is recognised
    testable: Testable = lambda _model, _records: None  # None, or why these recordings cannot show it
    kinds: frozenset[OutputKind] = frozenset(OutputKind)  # measured outputs it makes sense with
    profile: bool = False
    """True where the law is a curve over time, its knots estimated in each recording, without parameters."""
    event: bool = False  # true where it acts from a moment to another: has the parameters of MOMENTS
    step: Step | None = None  # where the event is a step of a nominal parameter
    permanent: str = ""  # the effect that the event is where it acts all along, if that is one
    phases: Mapping[str, str] = field(default_factory=dict)
    """Of a periodic law: parameter that is a phase, and the one that is its amplitude."""
    either: tuple[str, ...] = ()  # sizes, where its first parameter is not the only one that does something by itself
    widens: frozenset[str] = frozenset()  # nominal parameters that it moves beyond what they are trusted to
    described: Spans = lambda _model, _values, _line: {}
    """A nominal parameter's values with the effect: one span, or one before and one after."""
    implausible: Objection = lambda _model, _records, _values: ""
    """Why values that were found are no such physics; "" where they may be."""
    unresolved: Objection = lambda _model, _records, _values: ""
    """Why values that were found are too small for these recordings to show; "" where they are not."""
    rescaled: Callable[[Mapping[str, float]], Mapping[str, float]] = lambda _values: {}
    """By dimension: factor on the line's parameters in an equally good explanation that puts the fault elsewhere."""
    completed: Callable[[Mapping[str, float]], Mapping[str, float]] = lambda values: values
    """Values as a file or `hil sim` gives them, with what was left out filled in."""
    reparametrised: OtherForms = lambda _model, _records, _values, _line: []
    """Starts for the same law with the line's parameters changed, where a fit may be in a side minimum."""
    derived: Callable[[Mapping[str, float], Mapping[str, float]], Mapping[str, float]] = lambda _values, _nominal: {}
    """Quantities that follow from the values and are reported with them."""
    linear: bool = False  # true where the line stays linear with it, so that steps have a closed form
    waving: bool = False  # true where it changes all the time, so that the conditions are worked out at every sub-step
    timed: bool = False  # true where the simulated line depends on the time since its recording began
    swinging: bool = False
    """True where it ties the load to a place, as gravity does: makes no sense where the load turns round and round."""
    shows_start: frozenset[str] = frozenset()  # what else of a joint's start matters with it
    recognised: bool = False  # true where it is read off the samples (repeated, lost, rounded, late) and not fitted

    @property
    def sizes(self) -> tuple[str, ...]:
        """The parameters of which each does something by itself: the first, the amplitudes, or what is said."""
        return self.either or tuple(self.phases.values()) or (self.parameters[0].name,)

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
        """Those with one value in all recordings."""
        return tuple(parameter for parameter in self.parameters if not parameter.own)

    @property
    def own_parameters(self) -> tuple[EffectParameter, ...]:
        """Those with a value of each recording."""
        return tuple(parameter for parameter in self.parameters if parameter.own)
