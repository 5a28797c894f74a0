"""The variables of the exported driveline: names, units and values, and where each stands in the C array."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.kernel import slots, state_vector
from estimator.physics.kernel.state_vector import State
from estimator.physics.layout import SIZE, slot
from estimator.physics.model import parameter_unit, unit
from hil.export.fmu.driveline import Driveline

WARMTH = state_vector.STATES
"""Place of how warm the windings are, behind the states of the kernel."""

STATES = state_vector.STATES + 1

NAMED = (
    "TIME", "T_M1", "T_M2", "T_LOAD", "ANGLE_READ", "TURN_RATE",
    "SPEED_MEASURED", "SPEED_MOTOR", "SPEED_LOAD", "ANGLE_MOTOR", "TORQUE_SHAFT",
    "START_ANGLE", "START_SPEED", "START_TWIST", "START_LOAD_SPEED", "START_MIDDLE_TWIST", "START_MIDDLE_SPEED",
    "START_TRACTION", "BEFORE_ALL", "STEP_S", "SIGN_WIDTH", "ANGLE_IS_READ",
)  # fmt: skip
"""What stands first in the C array, in this order; the states, their derivatives and the parameters follow."""

STATE = len(NAMED)
DERIVATIVE = STATE + STATES
PARAMETER = DERIVATIVE + STATES
VALUES = PARAMETER + SIZE

_REST = ("lagged_torque", "lagged_torque_rise", "filtered", "filtered_rise", "bristles_motor", "bristles_load")
STATE_NAMES = (*State._fields, *_REST, "warmth")


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable of modelDescription.xml.

    Attributes
    ----------
    name, unit, description : str
    reference : int
        Place in the C array.
    causality, variability, initial : str
        As FMI has them; ``initial`` is empty where the standard's own applies.
    start : float or bool, optional
    derivative_of : int
        Reference of the state whose derivative it is; -1 for none.
    """

    name: str
    reference: int
    causality: str
    variability: str
    unit: str
    description: str
    start: float | bool | None = None
    initial: str = ""
    derivative_of: int = -1


def place(name: str) -> int:
    """Return the place of what is ``NAMED``."""
    return NAMED.index(name)


def continuous(d: Driveline) -> list[int]:
    """Return the states that the line has: those that are always at rest are left out."""
    p, masses = d.p, d.masses
    within = p[slots.BETWEEN] > 0.0 or p[slots.BEHIND] > 0.0
    has = {
        "angle": True,
        "speed": True,
        "twist": masses > 1,
        "load_speed": masses > 1,
        "loading": p[slots.SLIDER] != 0.0,
        "vehicle_speed": p[slots.SLIP] > 0.0,
        "traction": p[slots.RELAXATION] > 0.0,
        "relaxing": p[slots.RELAXING] > 0.0,
        "branch_twist": p[slots.BRANCH_INERTIA] > 0.0 or within,
        "branch_speed": p[slots.BRANCH_INERTIA] > 0.0 or within,
        "middle_twist": masses > 2,
        "middle_speed": masses > 2,
        "lagged_torque": p[slots.LAG] > 0.0,
        "lagged_torque_rise": p[slots.LAG] > 0.0 and p[slots.LAG_SHAPE] > 0.0,
        "filtered": p[slots.FILTER] > 0.0,
        "filtered_rise": p[slots.FILTER] > 0.0 and p[slots.FILTER_SHAPE] > 0.0,
        "bristles_motor": p[slots.COULOMB_PRESLIDING] > 0.0 or p[slots.STRIBECK_PRESLIDING] > 0.0,
        "bristles_load": p[slots.COULOMB_LOAD_PRESLIDING] > 0.0 or p[slots.BRAKE_PRESLIDING] > 0.0,
        "warmth": p[slot("torque_derating", "depth")] != 0.0 and p[slot("torque_derating", "heating_nm")] > 0.0,
    }
    return [i for i, name in enumerate(STATE_NAMES) if has[name]]


def variables(d: Driveline) -> list[Variable]:
    """Return all variables, in the order of modelDescription.xml."""
    states = continuous(d)
    return [
        Variable("time", place("TIME"), "independent", "continuous", "s", "time"),
        *_inputs(d),
        *_outputs(d),
        *_state_variables(d, states),
        *_parameters(d),
        *_starts(d),
    ]


def is_periodic(d: Driveline) -> bool:
    """Tell whether the line has laws over the motor's angle."""
    return any(EFFECTS[name].phases for name in d.effects)


def _inputs(d: Driveline) -> Iterator[Variable]:
    motion = d.motion
    given = [
        ("T_M1", "T_M1", "torque", "torque of the first input, as it is read"),
        ("T_M2", "T_M2", "torque", "torque of the second input, as it is read"),
        ("T_load", "T_LOAD", "torque", "load torque, against a motion forward"),
    ]
    if is_periodic(d):
        given += [
            ("angle_read", "ANGLE_READ", "angle", "motor angle as it is read, where angle_is_read"),
            ("turn_rate", "TURN_RATE", "speed", "mean rate of angle_read over the next step, for co-simulation"),
        ]
    for name, key, dimension, description in given:
        start = d.load if key == "T_LOAD" else 0.0
        yield Variable(name, place(key), "input", "continuous", unit(dimension, motion), description, start)


def _outputs(d: Driveline) -> Iterator[Variable]:
    given = [
        ("speed_measured", "SPEED_MEASURED", "speed", f"speed at the {d.sensor_at}, as its sensor shows it"),
        ("speed_motor", "SPEED_MOTOR", "speed", "speed of the motor"),
        ("angle_motor", "ANGLE_MOTOR", "angle", "angle of the motor"),
    ]
    if d.masses > 1:
        given += [
            ("speed_load", "SPEED_LOAD", "speed", "speed of the load, or of the wheels where the tyre slips"),
            ("torque_shaft", "TORQUE_SHAFT", "torque", "torque that the (first) shaft passes on to the load"),
        ]
    for name, key, dimension, description in given:
        yield Variable(name, place(key), "output", "continuous", unit(dimension, d.motion), description)


def _state_variables(d: Driveline, states: list[int]) -> Iterator[Variable]:
    for i in states:
        name = f"state.{STATE_NAMES[i]}"
        yield Variable(name, STATE + i, "local", "continuous", "", "", initial="calculated")
        yield Variable(
            f"der({name})", DERIVATIVE + i, "local", "continuous", "", "", initial="calculated", derivative_of=STATE + i
        )


def _parameters(d: Driveline) -> Iterator[Variable]:
    for name in d.structure.parameter_names:
        yield _parameter(name, slot("", name), parameter_unit(name, d.motion), "nominal parameter", d)
    for effect in d.effects:
        for each in EFFECTS[effect].parameters:
            at = slot(effect, each.name)
            if math.isfinite(d.p[at]):
                yield _parameter(f"{effect}.{each.name}", at, each.unit(d.motion), each.meaning, d)


def _parameter(name: str, at: int, of_unit: str, description: str, d: Driveline) -> Variable:
    return Variable(name, PARAMETER + at, "parameter", "fixed", of_unit, description, float(d.p[at]))


def _starts(d: Driveline) -> Iterator[Variable]:
    angle, speed, motion = "angle", "speed", d.motion
    given = [("start.angle", "START_ANGLE", angle), ("start.speed", "START_SPEED", speed)]
    if d.masses > 1:
        given += [("start.twist", "START_TWIST", angle), ("start.load_speed", "START_LOAD_SPEED", speed)]
    if d.masses > 2:
        given += [
            ("start.middle_twist", "START_MIDDLE_TWIST", angle),
            ("start.middle_speed", "START_MIDDLE_SPEED", speed),
        ]
    if "tyre_slip" in d.effects:
        given.append(("start.traction", "START_TRACTION", "torque"))
    for name, key, dimension in given:
        of_unit, start = unit(dimension, motion), d.start[key]
        yield Variable(name, place(key), "parameter", "fixed", of_unit, "state at the beginning", start)
    described = "longest integration step of the co-simulation"
    yield Variable("step_s", place("STEP_S"), "parameter", "fixed", "s", described, d.step_s)
    if any(EFFECTS[name].element in (Element.MOTOR, Element.LOAD) for name in d.effects):
        described = "speed within which dry friction changes sign"
        yield Variable(
            "sign_width", place("SIGN_WIDTH"), "parameter", "fixed", unit("speed", motion), described, d.sign_width
        )
    if is_periodic(d):
        described = "whether laws over the angle take it from angle_read and not from the simulation"
        yield Variable("angle_is_read", place("ANGLE_IS_READ"), "parameter", "fixed", "", described, d.angle_is_read)


def start_values(d: Driveline) -> list[float]:
    """Return the C array at the beginning."""
    values = [0.0] * PARAMETER + [float(value) for value in d.p[:SIZE]]
    named = {"T_LOAD": d.load, "STEP_S": d.step_s, "SIGN_WIDTH": d.sign_width, "ANGLE_IS_READ": float(d.angle_is_read)}
    for key, value in {**named, **d.start}.items():
        values[place(key)] = value
    return values
