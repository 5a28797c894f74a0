"""The catalogue's laws at their places: functions that put them together, written from what the entries declare.

Each is a few lines of Python text (`written`). They are compiled into the simulation that calls them, of one line or of
several in lanes, and they are what an exported FMU has in C.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from types import GenericAlias
from typing import Any

from estimator.lanes import broadcast_as, some
from estimator.physics.catalogue import BUILT_IN, KERNEL
from estimator.physics.effect import Around, Effect, Place
from estimator.physics.kernel.state_vector import LAW_STATES, WITH_STATE, LawStates
from estimator.physics.kernel.written import Scope, several, written
from estimator.physics.layout import slot
from estimator.signals.record import FloatArray

GIVEN = {
    Place.DRIVE_ANGLE: ("angle",),
    Place.MOTOR: ("speed",),
    Place.MOTOR_DRY: ("speed",),
    Place.MOTOR_INERTIA: ("inertia", "time_s", "length_s"),
    Place.CARDAN: ("angle",),
    Place.STIFFNESS: ("stiffness", "time_s", "length_s"),
    Place.SPRING: ("twist",),
    Place.SHAFT: ("twist", "rate"),
    Place.SHAFT_LOSS: ("torque", "direction"),
    Place.LOAD: ("speed",),
    Place.LOAD_DRY: ("time_s", "length_s"),
    Place.LOAD_DAMPING: ("damping", "time_s", "length_s"),
    Place.LOAD_INERTIA: ("inertia", "time_s", "length_s"),
    Place.LOAD_ANGLE: ("angle",),
    Place.RECORDED_ANGLE: ("angle",),
    Place.RESOLVER: ("speed", "angle"),
    Place.SENSOR: ("reading",),
}
"""What a place gives its laws before their parameters; one with a state gets that and what is around it, too."""

SCOPE: Scope = {
    "__name__": __name__,
    "broadcast_as": broadcast_as,
    "some": some,
    **{f"{each.name}_law": each.acting.law for each in BUILT_IN.values() if each.acting is not None},
    **{f"{each.name}_rate": each.acting.rate for each in WITH_STATE if each.acting is not None},
}
"""What the texts name."""

OF_STATES: dict[str, object] = {"states": LawStates, "around": Around, "p": FloatArray}
"""What follows on what a place gives, where laws have states."""


def at_place(place: Place) -> Iterator[Effect]:
    """Yield the entries whose law acts at a place."""
    return (each for each in BUILT_IN.values() if each.acting is not None and each.acting.place is place)


def parameters_of(entry: Effect) -> str:
    """Return the parameters of an entry as a call's arguments, out of the kernel's vector."""
    return ", ".join(f"p[{slot(entry.name, each.name)}]" for each in entry.parameters)


def is_on(entry: Effect) -> str:
    """Return the condition under which a law does anything: one of its sizes is off its null."""
    sizes = (each for each in entry.parameters if each.name in entry.sizes)
    return " | ".join(f"some(p[{slot(entry.name, each.name)}] != {each.null!r})" for each in sizes)


def called(entry: Effect, place: Place) -> str:
    """Return the call of an entry's law without a state."""
    return f"{entry.name}_law({', '.join(GIVEN[place])}, {parameters_of(entry)})"


def given_at(place: Place) -> dict[str, object]:
    """Return the arguments of a place's function and their types."""
    return {**dict.fromkeys(GIVEN[place], float), "p": FloatArray}


def total(place: Place, name: str, is_lasting: bool = False) -> Callable[..., float]:
    """Return the function that adds up a place's laws without a state [Nm], events left out where it ``is_lasting``."""
    calls = [
        called(each, place) for each in at_place(place) if each not in WITH_STATE and not (is_lasting and each.event)
    ]
    body = [f"return {' + '.join([f'broadcast_as(0.0, {GIVEN[place][0]})', *calls])}"]
    return written(name, given_at(place), float, body, SCOPE)


def totals(place: Place, name: str, values: int) -> Callable[..., Any]:
    """Return the function that adds up what a place's laws return, several values each."""
    laws = list(at_place(place))
    body = [f"law{i} = {called(each, place)}" for i, each in enumerate(laws)]
    sums = (" + ".join(f"law{i}[{value}]" for i in range(len(laws))) or "0.0" for value in range(values))
    returned = GenericAlias(tuple, (float,) * values)
    return written(name, given_at(place), returned, [*body, f"return {several(sums)}"], SCOPE)


def changed(place: Place, name: str) -> Callable[..., float]:
    """Return the function that hands the first that a place gives on from one of its laws to the next."""
    value = GIVEN[place][0]
    body = [*(f"{value} = {called(each, place)}" for each in at_place(place)), f"return {value}"]
    return written(name, given_at(place), float, body, SCOPE)


def total_with_states(place: Place, name: str) -> Callable[..., float]:
    """Return the function that adds up a place's laws with a state [Nm], of what it gives, states and ``Around``."""
    given, body = GIVEN[place], [f"torque = broadcast_as(0.0, {GIVEN[place][0]})"]
    for each in at_place(place):
        if each in WITH_STATE:
            state = f"states[{WITH_STATE.index(each)}]"
            call = f"{each.name}_law({', '.join(given)}, {state}, around, {parameters_of(each)})"
            body += [f"if {is_on(each)}:", f"    torque = torque + {call}"]
    types: dict[str, object] = {**dict.fromkeys(given, float), **OF_STATES}
    return written(name, types, float, [*body, "return torque"], SCOPE)


def rates_of_states(name: str) -> Callable[..., LawStates]:
    """Return the function that gives each law's rate, of the speeds of motor and load, the shaft's twist and rate."""
    body = []
    for place, given in ((Place.MOTOR, "motor"), (Place.LOAD, "load"), (Place.SHAFT, "twist, rate")):
        for each in at_place(place):
            if each in WITH_STATE:
                i = WITH_STATE.index(each)
                call = f"{each.name}_rate({given}, states[{i}], around, {parameters_of(each)})"
                body += [f"rate{i} = broadcast_as(0.0, motor)", f"if {is_on(each)}:", f"    rate{i} = {call}"]
    body.append(f"return {several(f'rate{i}' for i in range(LAW_STATES))}")
    types: dict[str, object] = {**dict.fromkeys(("motor", "load", "twist", "rate"), float), **OF_STATES}
    return written(name, types, LawStates, body, SCOPE)


def largest(place: Place, parameter: str, name: str) -> Callable[[FloatArray], float]:
    """Return the function that gives the largest value of a parameter of this name among a place's laws."""
    values = [f"p[{slot(each.name, parameter)}]" for each in at_place(place)]
    body = ["value = " + values[0], *(f"value = max(value, {each})" for each in values[1:]), "return value"]
    return written(name, {"p": FloatArray}, float, body, SCOPE)


def any_on(entries: Iterable[Effect], name: str) -> Callable[[FloatArray], bool]:
    """Return the function that tells whether the law of one of some entries does anything."""
    return written(name, {"p": FloatArray}, bool, [f"return {' | '.join(map(is_on, entries)) or 'False'}"], SCOPE)


rippled = totals(Place.DRIVE_ANGLE, "rippled", 2)
motor_drag = total(Place.MOTOR, "motor_drag")
motor_sliding = total(Place.MOTOR_DRY, "motor_sliding")
motor_inertia = changed(Place.MOTOR_INERTIA, "motor_inertia")
in_cardan = totals(Place.CARDAN, "in_cardan", 4)
shaft_stiffness = changed(Place.STIFFNESS, "shaft_stiffness")
spring_twist = changed(Place.SPRING, "spring_twist")
shaft_loss = total(Place.SHAFT_LOSS, "shaft_loss")
load_drag = total(Place.LOAD, "load_drag")
load_sliding = total(Place.LOAD_DRY, "load_sliding")
load_lasting = total(Place.LOAD_DRY, "load_lasting", is_lasting=True)
load_damping = changed(Place.LOAD_DAMPING, "load_damping")
load_inertia = changed(Place.LOAD_INERTIA, "load_inertia")
held_by_angle = total(Place.LOAD_ANGLE, "held_by_angle")
load_over_angle = total(Place.RECORDED_ANGLE, "load_over_angle")
resolved = changed(Place.RESOLVER, "resolved")
recorded = changed(Place.SENSOR, "recorded")

motor_memory = total_with_states(Place.MOTOR, "motor_memory")
load_memory = total_with_states(Place.LOAD, "load_memory")
shaft_memory = total_with_states(Place.SHAFT, "shaft_memory")
state_rates = rates_of_states("state_rates")

motor_presliding = largest(Place.MOTOR_DRY, "presliding_rad", "motor_presliding")
load_presliding = largest(Place.LOAD_DRY, "presliding_rad", "load_presliding")
motor_creep = largest(Place.MOTOR_DRY, "creep_rad_s", "motor_creep")
load_creep = largest(Place.LOAD_DRY, "creep_rad_s", "load_creep")

is_shaft_bent = any_on([*at_place(Place.CARDAN), *at_place(Place.SPRING), BUILT_IN["backlash"]], "is_shaft_bent")
has_dry_friction_at_motor = any_on(at_place(Place.MOTOR_DRY), "has_dry_friction_at_motor")
has_dry_friction_at_load = any_on(at_place(Place.LOAD_DRY), "has_dry_friction_at_load")
is_waving = any_on((each for each in KERNEL.values() if each.waving), "is_waving")
has_states = any_on(WITH_STATE, "has_states")

moved_states: Callable[..., LawStates] = written(
    "moved_states",
    {"states": LawStates, "rates": LawStates, "time_s": float},
    LawStates,
    [f"return {several(f'states[{i}] + time_s * rates[{i}]' for i in range(LAW_STATES))}"],
    SCOPE,
)
"""The states of laws after a time at constant rates."""

no_states: Callable[..., LawStates] = written(
    "no_states",
    {"like": float},
    LawStates,
    [f"return {several('broadcast_as(0.0, like)' for _ in range(LAW_STATES))}"],
    SCOPE,
)
"""A 0 of the kind of ``like`` for each law with a state."""
