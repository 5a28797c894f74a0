"""What of a model is exported: its parameters, what it starts from, and what can't be taken along, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from estimator.diagnosis.acquisition.chain import without_acquisition_effects
from estimator.diagnosis.segments import tiles
from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import Case
from estimator.physics.effect import Element
from estimator.physics.free_run import settle
from estimator.physics.inputs import load_of
from estimator.physics.kernel import state_vector
from estimator.physics.kernel.integration import with_mode
from estimator.physics.layout import LOAD, SIZE, Grid, flat, slot, substeps_for
from estimator.physics.model import DrivelineModel, Motion, Structure, parameter_unit, unit
from estimator.physics.problem import case_of, local_part, make_problem
from estimator.physics.simulate import MASSES, SIGN_WIDTH_RAD_S
from estimator.signals.record import FloatArray, Location, Record
from hil.errors import UsageError

OF_THE_RECORDER = ("stale_samples", "lost_samples", "sample_jitter", "clock_drift")
"""Effects of what records, not of the line: a simulation has no recorder."""

_START = {
    "angle_rad": "START_ANGLE",
    "speed_rad_s": "START_SPEED",
    "twist_rad": "START_TWIST",
    "load_speed_rad_s": "START_LOAD_SPEED",
    "middle_twist_rad": "START_MIDDLE_TWIST",
    "middle_speed_rad_s": "START_MIDDLE_SPEED",
    "load_torque_nm": "START_TRACTION",
}

_QUANTISATION = slot("speed_quantisation", "step_rad_s")

WARMTH = state_vector.STATES
"""Place of how warm the windings are, behind the states of the kernel."""

STATES = state_vector.STATES + 1

NAMED = (
    "TIME", "T_M1", "T_M2", "T_LOAD", "ANGLE_READ", "TURN_RATE",
    "SPEED_MEASURED", "SPEED_MOTOR", "SPEED_LOAD", "ANGLE_MOTOR", "TORQUE_SHAFT",
    "START_ANGLE", "START_SPEED", "START_TWIST", "START_LOAD_SPEED", "START_MIDDLE_TWIST", "START_MIDDLE_SPEED",
    "START_TRACTION", "BEFORE_ALL", "STEP_S", "SIGN_WIDTH", "ANGLE_IS_READ",
    "SPEED_SEEN", "TORQUE_PASSED", "LOAD_PASSED", "SEEN_BEFORE", "OTHER_BEFORE", "ACTED", "STEPS_DONE",
)  # fmt: skip
"""What stands first in the C array, in this order; the states, their derivatives and the parameters follow."""

STATE = len(NAMED)
PARAMETER = STATE + STATES
VALUES = PARAMETER + SIZE


@dataclass(frozen=True, slots=True)
class Driveline:
    """A line to be written as C."""

    name: str  # of the model, as an FMU has it
    structure: Structure  # masses and shafts of the line
    motion: Motion  # rotation or translation, by which units go
    p: FloatArray  # (layout.SIZE,): Parameters of the superset model
    effects: tuple[str, ...]  # those that the line has, by name
    sensor_at: str  # mass whose motion is the output
    period_s: float  # of one step of the communication [s]
    step_s: float  # longest integration step [s]
    sign_width: float  # speed within which dry friction changes sign
    load: float  # load torque at the beginning [Nm]
    start: Mapping[str, float]  # state at the beginning, by the name of its place (``variables.NAMED``)
    angle_is_read: bool  # whether laws over the angle take it from an input
    left_out: tuple[str, ...]  # sentences about what is not in it
    is_around: bool = False  # whether its inertia is that at a shaft of another FMU, to which it passes on a torque

    @property
    def masses(self) -> int:
        """How many inertias it has."""
        return len(MASSES[self.structure])


def driveline(name: str, model: DrivelineModel, period_s: float, sensor_at: Location = Location.MOTOR) -> Driveline:
    """Return what of a model can be exported, at rest without a load."""
    if model.structure is Structure.JOINT:
        raise UsageError("structure = 'joint': expected a driveline of 1 to 3 masses to export, got a joint")
    left = [each for each in model.effects if each in OF_THE_RECORDER]
    kept = replace(model, effects={each: values for each, values in model.effects.items() if each not in left})
    p = flat(kept)
    substeps = with_mode(substeps_for(kept.values(), period_s), period_s, p)
    notes = [f"{each} is of what records, not of the line: it is left out" for each in left]
    if "road_grade" in kept.effects:
        notes.append("road_grade is a load over time: give it through T_load")
    load = float(p[slot("", LOAD)])
    return Driveline(
        name,
        kept.structure,
        kept.motion,
        p,
        tuple(kept.effects),
        sensor_at.value,
        period_s,
        period_s / substeps,
        SIGN_WIDTH_RAD_S,
        load,
        dict.fromkeys(_START.values(), 0.0) | {"START_TRACTION": load},
        False,
        tuple(notes),
    )


def begun(d: Driveline, model: DrivelineModel, record: Record) -> tuple[Driveline, FloatArray]:
    """Return a line that starts as it does in a recording, and its load torque there, shape (N,) [Nm].

    Load torque, initial state, phases and moments are those that ``hil simulate`` estimates; of a recording with long
    gaps those of its first stretch.
    """
    record = tiles(record)[0]
    model = without_acquisition_effects(
        replace(model, effects={each: v for each, v in model.effects.items() if each != "clock_drift"})
    )
    problem = make_problem(model, [record], (), profile=any(EFFECTS[each].profile for each in model.effects))
    result = settle(problem)
    case = case_of(result.problem.local[0], result.problem.p, local_part(result.problem, result.x, 0))
    case.p[_QUANTISATION] = d.p[_QUANTISATION]  # left out of fits, but the sensor's own
    return started(d, result.problem.grid, case, record)


def started(d: Driveline, grid: Grid, case: Case, record: Record) -> tuple[Driveline, FloatArray]:
    """Return a line with parameters and start of a simulation of a recording, and its load torque, (N,) [Nm]."""
    substeps = with_mode(grid.substeps, record.sample_time_s, case.p)
    load = load_of(case, record)
    line = replace(
        d,
        p=case.p,
        period_s=record.sample_time_s,
        step_s=record.sample_time_s / substeps,
        sign_width=grid.sign_width,
        load=float(load[0]),
        start={key: float(getattr(case.start, attribute)) for attribute, key in _START.items()},
    )
    return line, load


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable of modelDescription.xml."""

    name: str  # of the variable
    reference: int  # place in the C array
    causality: str  # input, output, parameter, … as FMI has them
    variability: str  # fixed, tunable, continuous, … as FMI has them
    unit: str  # as FMI writes units; empty for a number
    description: str  # in words
    start: float | bool | None = None  # None where FMI allows none


def place(name: str) -> int:
    """Return the place of what is ``NAMED``."""
    return NAMED.index(name)


def variables(d: Driveline) -> list[Variable]:
    """Return all variables, in the order of modelDescription.xml."""
    return [
        Variable("time", place("TIME"), "independent", "continuous", "s", "time"),
        *_inputs(d),
        *_outputs(d),
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
    if d.is_around:
        given.append(("speed_seen", "SPEED_SEEN", "speed", "speed of the shaft in the FMU that this one is around"))
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
    if d.is_around:
        given += [
            ("torque_passed", "TORQUE_PASSED", "torque", "torque for the shaft in the FMU that this one is around"),
            ("load_passed", "LOAD_PASSED", "torque", "the same as a load torque, against a motion forward"),
        ]
    for name, key, dimension, description in given:
        yield Variable(name, place(key), "output", "continuous", unit(dimension, d.motion), description)


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
