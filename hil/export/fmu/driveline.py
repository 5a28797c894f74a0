"""What of a model is exported: its parameters, what it starts from, and what can't be taken along, in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from estimator.diagnosis.chain import mechanical
from estimator.diagnosis.segments import tiles
from estimator.physics.catalogue import EFFECTS
from estimator.physics.free_run import settle
from estimator.physics.grid import Grid, substeps_for
from estimator.physics.inputs import Case, load_of
from estimator.physics.kernel.integration import with_mode
from estimator.physics.layout import LOAD, flat, slot
from estimator.physics.model import DrivelineModel, Motion, Structure
from estimator.physics.problem import case_of, local_part, make_problem
from estimator.physics.simulate import MASSES
from estimator.physics.stepper import SIGN_WIDTH_RAD_S
from estimator.signals.record import FloatArray, Location, Record
from hil.errors import UsageError

OF_THE_RECORDER = ("stale_samples", "lost_samples", "sample_jitter", "clock_drift")
"""Effects of what records, not of the line: a simulation has no recorder."""


@dataclass(frozen=True, slots=True)
class Driveline:
    """A line to be written as C.

    Attributes
    ----------
    p : ndarray, shape (layout.SIZE,)
        Parameters of the superset model.
    effects : tuple of str
        Those that the line has, by name.
    load : float
        Load torque at the beginning [Nm].
    start : mapping of str to float
        State at the beginning, by the name of its place (``variables.NAMED``).
    step_s, sign_width : float
        Longest integration step [s], and speed within which dry friction changes sign.
    angle_is_read : bool
        Whether laws over the angle take it from an input.
    left_out : tuple of str
        Sentences about what is not in it.
    """

    name: str
    structure: Structure
    motion: Motion
    p: FloatArray
    effects: tuple[str, ...]
    sensor_at: str
    period_s: float
    step_s: float
    sign_width: float
    load: float
    start: Mapping[str, float]
    angle_is_read: bool
    left_out: tuple[str, ...]

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


_START = {
    "angle_rad": "START_ANGLE",
    "speed_rad_s": "START_SPEED",
    "twist_rad": "START_TWIST",
    "load_speed_rad_s": "START_LOAD_SPEED",
    "middle_twist_rad": "START_MIDDLE_TWIST",
    "middle_speed_rad_s": "START_MIDDLE_SPEED",
    "load_torque_nm": "START_TRACTION",
}


def begun(d: Driveline, model: DrivelineModel, record: Record) -> tuple[Driveline, FloatArray]:
    """Return a line that starts as it does in a recording, and its load torque there, shape (N,) [Nm].

    Load torque, initial state, phases and moments are those that ``hil simulate`` estimates; of a recording with long
    gaps those of its first stretch.
    """
    record = tiles(record)[0]
    model = mechanical(replace(model, effects={each: v for each, v in model.effects.items() if each != "clock_drift"}))
    problem = make_problem(model, [record], (), profile=any(EFFECTS[each].profile for each in model.effects))
    result = settle(problem)
    case = case_of(result.problem.local[0], result.problem.p, local_part(result.problem, result.x, 0))
    case.p[_QUANTISATION] = d.p[_QUANTISATION]  # left out of fits, but the sensor's own
    return started(d, result.problem.grid, case, record)


_QUANTISATION = slot("speed_quantisation", "step_rad_s")


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
