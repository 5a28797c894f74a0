"""The catalogue's laws at their places: functions that add them up, written from what the entries declare.

Each is a few lines of Python text (`written`). They are compiled into the simulation that calls them, of one line or of
several in lanes, and they are what an exported FMU has in C.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from estimator.lanes import broadcast_as, some
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.effect import Around, Effect, Place
from estimator.physics.kernel.state_vector import LAW_STATES, WITH_STATE, LawStates
from estimator.physics.kernel.written import Scope, several, written
from estimator.physics.layout import slot
from estimator.signals.record import FloatArray

GIVEN = {
    Place.MOTOR: ("speed",),
    Place.LOAD: ("speed",),
    Place.LOAD_ANGLE: ("angle",),
    Place.RECORDED_ANGLE: ("angle",),
    Place.SHAFT_LOSS: ("torque", "direction"),
    Place.SHAFT: ("twist", "rate"),
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
    """Return the condition under which a law does anything: its size is off its null."""
    return f"some(p[{slot(entry.name, entry.parameters[0].name)}] != {entry.parameters[0].null!r})"


def total(place: Place, name: str) -> Callable[..., float]:
    """Return the sum of a place's laws without a state [Nm], of what it gives and the parameters."""
    given = GIVEN[place]
    calls = [
        f"{each.name}_law({', '.join(given)}, {parameters_of(each)})"
        for each in at_place(place)
        if each not in WITH_STATE
    ]
    body = [f"return {' + '.join([f'broadcast_as(0.0, {given[0]})', *calls])}"]
    return written(name, {**dict.fromkeys(given, float), "p": FloatArray}, float, body, SCOPE)


def total_with_states(place: Place, name: str) -> Callable[..., float]:
    """Return the sum of a place's laws with a state [Nm], of what it gives, the states, ``Around``, the parameters."""
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


motor_drag = total(Place.MOTOR, "motor_drag")
load_drag = total(Place.LOAD, "load_drag")
held_by_angle = total(Place.LOAD_ANGLE, "held_by_angle")
over_recorded_angle = total(Place.RECORDED_ANGLE, "over_recorded_angle")
shaft_loss = total(Place.SHAFT_LOSS, "shaft_loss")

motor_memory = total_with_states(Place.MOTOR, "motor_memory")
load_memory = total_with_states(Place.LOAD, "load_memory")
shaft_memory = total_with_states(Place.SHAFT, "shaft_memory")
state_rates = rates_of_states("state_rates")

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

has_states: Callable[[FloatArray], bool] = written(
    "has_states",
    {"p": FloatArray},
    bool,
    [f"return {' | '.join(f'({is_on(each)})' for each in WITH_STATE) or 'False'}"],
    SCOPE,
)
"""Whether any law with a state is there."""
