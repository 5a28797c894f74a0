"""Free-run simulation of one recording: measured torques in, simulated output out, nothing fed back."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from estimator.errors import BadModel
from estimator.lanes import LANES
from estimator.physics import catalogue, joint
from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.effect import Element
from estimator.physics.effects.timing import TRANSPORT_DELAY
from estimator.physics.inputs import begun_states, initial_state, inputs_of, load_of, shaft_torque_from
from estimator.physics.kernel import integration, sensing, side_by_side, state_vector
from estimator.physics.kernel.integration import Masses
from estimator.physics.layout import OBSERVER, Grid, flat, slot, substeps_for
from estimator.physics.model import DrivelineModel, Structure
from estimator.physics.motion import motor_angle
from estimator.physics.own_law import FORCES
from estimator.physics.parallel import PARTS, concurrently, count_samples
from estimator.signals.record import FloatArray, IntArray, Location, OutputKind, Record

MASSES: dict[Structure, Masses] = {
    Structure.ONE_MASS: (1,),
    Structure.TWO_MASS: (1, 2),
    Structure.THREE_MASS: (1, 2, 3),
}
"""How many inertias the kernel has for a structure."""

_OUTPUT_STATE = {
    (OutputKind.SPEED, Location.MOTOR): state_vector.SPEED,
    (OutputKind.SPEED, Location.LOAD): state_vector.LOAD_SPEED,
    (OutputKind.POSITION, Location.MOTOR): state_vector.ANGLE,
    (OutputKind.POSITION, Location.LOAD): state_vector.LOAD_ANGLE,
    (OutputKind.TORQUE, Location.SHAFT): state_vector.SHAFT_TORQUE,
    (OutputKind.TORQUE, Location.LOAD): state_vector.SHAFT_TORQUE,
    (OutputKind.ACCELERATION, Location.MOTOR): state_vector.SPEED,
    (OutputKind.ACCELERATION, Location.LOAD): state_vector.LOAD_SPEED,
}
"""What the kernel gives of each output; of an acceleration the speed, whose slope it is."""

_SENSED = (state_vector.SPEED, state_vector.LOAD_SPEED)  # what the effects of a speed sensor act on

PERIODIC = np.array([slot(e.name, size) for e in catalogue.KERNEL.values() for size in e.phases.values()])
"""Amplitudes of the laws that are periodic in the motor's angle."""

TIMED = np.array([slot(e.name, e.parameters[0].name) for e in catalogue.BUILT_IN.values() if e.event or e.timed])
"""Sizes of the laws that depend on the time since a recording began."""

LENGTHS_DIFFER = 1.1
"""Length of the longest recording over the mean of all from which they go each by itself: the others would continue to
its end."""

SIGN_WIDTH_RAD_S = 0.02  # dry friction of a simulated rig changes sign within this speed; its noise is larger

FINER = 2
"""A rig is stepped once and not thousands of times as in a fit: finer steps let friction stick closer to standstill."""


def output_state(record: Record, structure: Structure) -> int:
    """Return the entry of the state that a recording measures; BadModel where recording and structure do not fit."""
    if (record.imposed is not None) != (structure is Structure.JOINT):
        got = "an imposed motion" if record.imposed is not None else f"{record.kind.value} as the output"
        raise BadModel(
            f"recording {record.name}: got {got}, expected the torque under an imposed motion for a joint, and a "
            f"measured motion for every other structure; the model is a {structure.value}. Correct the structure."
        )
    if structure is Structure.JOINT:
        return joint.TORQUE
    index = _OUTPUT_STATE.get((record.kind, record.location))
    if index is None or (structure is Structure.ONE_MASS and record.location is not Location.MOTOR):
        raise BadModel(
            f"recording {record.name}: {record.kind.value} at the {record.location.value} is no output of "
            f"{structure.value}. Expected speed, position or acceleration at the motor or, where the structure has a "
            "shaft, at the load, or torque at the shaft."
        )
    return index


def _is_slope(record: Record) -> bool:
    return record.kind is OutputKind.ACCELERATION


def simulate(
    grid: Grid,
    record: Record,
    p: FloatArray,
    start: InitialCondition,
    extra_load_nm: FloatArray | None = None,
    output: int | None = None,
) -> FloatArray:
    """Simulate the recorded output, as its sensor shows it, from the recorded torque.

    Parameters
    ----------
    p, start, extra_load_nm
        See ``Case``.
    output : int, optional
        State to return (``state_vector.SPEED`` ...), without the sensor; the recorded output by default.

    Returns
    -------
    ndarray, shape (N,)
        In the unit of ``record.output``.
    """
    return simulate_each(grid, record, [Case(p, start, extra_load_nm)], output)[0]


def simulate_each(
    grid: Grid,
    record: Record,
    cases: Sequence[Case],
    output: int | None = None,
    alike_s: FloatArray | None = None,
) -> FloatArray:
    """Simulate a recording several times; see ``simulate``."""
    if output is not None:
        return _simulated(grid, [record], cases, np.array([output]), False, alike_s)[:, 0]
    return simulate_outputs(grid, [record], cases, alike_s)[:, 0]


def simulate_outputs(
    grid: Grid, outputs: Sequence[Record], cases: Sequence[Case], alike_s: FloatArray | None = None
) -> FloatArray:
    """Simulate several measured outputs of one recording (``signals.outputs``), each as its sensor shows it."""
    if grid.plant is not None:
        count_samples(len(cases) * outputs[0].time_s.size)
        return np.stack([grid.plant.simulated(record, cases) for record in outputs], axis=1)
    if len(outputs) > 1 and any(map(is_steep, outputs)):  # the kernel leaves the slopes of one output
        return np.concatenate([simulate_outputs(grid, [record], cases, alike_s) for record in outputs], axis=1)
    wanted = np.array([output_state(record, grid.structure) for record in outputs])
    return _simulated(grid, outputs, cases, wanted, True, alike_s)


def is_steep(record: Record) -> bool:
    """Tell whether an output is found from a simulation's slopes."""
    return _is_slope(record) or record.offset_s is not None


def is_sensed(record: Record, wanted: int) -> bool:
    """Tell whether an output is read by the sensor that effects of the sensor are of: the first one of a recording."""
    return record.lead is None and wanted in _SENSED


def _simulated(
    grid: Grid,
    outputs: Sequence[Record],
    cases: Sequence[Case],
    wanted: IntArray,
    recorded: bool,
    alike_s: FloatArray | None,
) -> FloatArray:
    """Return states ``wanted``, shape (C,), of cases of one recording, as they are ``recorded`` or as they are."""
    record = outputs[0]
    count_samples(len(cases) * record.time_s.size)
    if grid.structure is Structure.JOINT:
        imposed = joint.imposed_in(record)
        return np.array([[_joint_output(record, imposed, case, int(state)) for state in wanted] for case in cases])
    own, given = _own_of(grid, record, cases), inputs_of([record], [0] * len(cases), cases)
    rows, samples = len(cases), record.time_s.size
    slopes = np.zeros((rows, 2, samples if recorded and is_steep(record) else 0))
    out = np.empty((rows, wanted.size, samples))
    side_by_side.integrate_each(
        MASSES[grid.structure],
        own,
        record.sample_time_s,
        grid.substeps,
        grid.sign_width,
        record.since_start_s[0],
        given.torque,
        given.load,
        given.fed_by,
        given.loaded_by,
        _angle(record, given.p),
        _followed(record, given.p),
        given.p,
        given.state,
        wanted,
        recorded and is_sensed(record, wanted[0]),
        out,
        slopes,
        _samples_alike(record, rows, alike_s),
    )
    if own:
        own[1].finish()
    if not recorded:
        return out
    if grid.laws and record.lead is None:
        for row, case in zip(out, cases, strict=True):
            row[0] += _misread(grid, record, case)
    return _read(outputs, out, slopes)


def _read(outputs: Sequence[Record], out: FloatArray, slopes: FloatArray) -> FloatArray:
    """Return what is read of outputs, shape (..., C, N), in their own units; ``slopes``, (..., 2, N), of the first."""
    units = np.array([record.unit for record in outputs])[:, np.newaxis]
    if _is_slope(outputs[0]):  # of a torque held over each period the mean of both sides
        found: FloatArray = 0.5 * slopes.sum(axis=-2, keepdims=True) / units
        found[..., 0, [0, -1]] = slopes[..., [1, 0], [0, -1]] / units
        return found
    return _sampled_off_time(out, slopes, outputs[0].offset_s) / units


def _samples_alike(record: Record, count: int, alike_s: FloatArray | None) -> IntArray:
    """Return how many samples each case has in common with the first one; all for that one itself."""
    alike = np.zeros(count, dtype=np.int64)
    if alike_s is not None:
        alike[:] = np.searchsorted(record.since_start_s, alike_s - record.sample_time_s)
    alike[0] = record.time_s.size
    return alike


def _angle(record: Record, p: FloatArray) -> FloatArray:
    """Return the angle that periodic laws take their phase from; 0 where none of the parameters (K, SIZE) needs it."""
    if p[:, PERIODIC].any():
        return motor_angle(record)
    return np.zeros(record.time_s.size)


def _followed(record: Record, p: FloatArray) -> FloatArray:
    """Return the reading that simulations follow as observers, shape (N,) in SI units; (0,) where none does."""
    if not p[:, slot("", OBSERVER)].any():
        return np.zeros(0)
    good = np.flatnonzero(record.okay)
    return np.interp(record.time_s, record.time_s[good], record.output[good]) * record.unit


def _sampled_off_time(out: FloatArray, slopes: FloatArray, offset_s: FloatArray | None) -> FloatArray:
    """Return outputs (..., C, N) as they were when the samples were taken, off their time stamps [s]."""
    if offset_s is None or slopes.shape[-1] == 0:
        return out
    return out + np.where(offset_s < 0.0, slopes[..., :1, :], slopes[..., 1:, :]) * offset_s


def _joint_output(record: Record, imposed: joint.Imposed, case: Case, output: int) -> FloatArray:
    start, load = case.start, load_of(case, record)
    return joint.simulate(record, imposed, case.p, load, start.twist_rad, start.preload_nm, output)


def _own_of(grid: Grid, record: Record, cases: Sequence[Case]) -> tuple[Any, ...]:
    """Return the user's own laws that any of some cases switches on, as the kernel takes them."""
    laws = [law for law in grid.acting([case.p for case in cases]) if law.law.element in FORCES]
    return (record.total_torque_nm, grid.forces(tuple(laws)), 0.0, 0.0) if laws else ()


def _misread(grid: Grid, record: Record, case: Case) -> FloatArray | float:
    """Return the error that a user's own laws at the sensor add to the reading, shape (N,); 0 without any."""
    laws = [law for law in grid.active(case.p) if law.law.element is Element.SPEED_SENSOR]
    if not laws:
        return 0.0
    states = np.array([state_vector.SPEED, state_vector.LOAD_SPEED, state_vector.TWIST])
    motion = _simulated(grid, [record], [case], states, False, None)[0]
    if grid.structure is Structure.ONE_MASS:
        motion[1:] = motion[0], np.zeros(motion.shape[1])
    arguments = np.vstack([record.since_start_s, motion, record.total_torque_nm])
    return np.sum([law.law(arguments, law.values(case.p)) for law in laws], axis=0)


Outputs = Sequence[Record]
"""A recording's measured outputs, each as a recording of one output (``signals.outputs``)."""


def simulate_records(grid: Grid, drives: Sequence[Outputs], cases: Sequence[Case]) -> list[FloatArray]:
    """Simulate every output of several recordings, a case of each: side by side or on all cores."""
    count = len(drives)
    fill_lanes = 1 < count <= LANES or (count > LANES and are_of_a_length(drives))
    if not fill_lanes or not go_together(grid, drives, [case.p for case in cases]):
        return concurrently(lambda i: simulate_outputs(grid, drives[i], [cases[i]])[0], range(count))
    parts = [range(count)[part] for part in lanes_filled(count)]
    runs = concurrently(lambda part: simulate_together(grid, drives, part, [cases[i] for i in part]), parts)
    found = (each for run in runs for each in run)
    return [each[:, : outputs[0].time_s.size] for each, outputs in zip(found, drives, strict=True)]


def lanes_filled(count: int, most: int = sys.maxsize) -> list[slice]:
    """Return so many simulations in parts that fill the lanes, more where only ``most`` lanefuls fit."""
    width = LANES * min(math.ceil(count / (PARTS * LANES)), most)
    return [slice(first, first + width) for first in range(0, count, width)]


def are_of_a_length(drives: Sequence[Outputs]) -> bool:
    """Tell whether recordings that are simulated as if they were one all end at about the same time."""
    sizes = [outputs[0].time_s.size for outputs in drives]
    return max(sizes) * len(sizes) <= LENGTHS_DIFFER * sum(sizes)


def go_together(grid: Grid, drives: Sequence[Outputs], lines: Sequence[FloatArray], moved: Sequence[int] = ()) -> bool:
    """Tell whether several recordings can be simulated as if they were one."""
    if grid.structure is Structure.JOINT or grid.plant is not None or any(grid.active(p) for p in lines):
        return False
    p = np.array(lines)
    acts = (p != 0.0).any(axis=0)
    acts[list(moved)] = True
    if len({_make(outputs) for outputs in drives}) > 1 or any(is_steep(each) for outputs in drives for each in outputs):
        return False
    begin_alike = len({outputs[0].since_start_s[0] for outputs in drives}) == 1
    if acts[PERIODIC].any() or acts[slot("", OBSERVER)] or not (begin_alike or not acts[TIMED].any()):
        return False
    return side_by_side.can_share_lanes(MASSES[grid.structure], p, np.arange(len(lines)))


def _make(outputs: Outputs) -> tuple[object, ...]:
    """Return what recordings that are simulated as if they were one have in common."""
    return outputs[0].sample_time_s, *((each.kind, each.location, each.lead is None) for each in outputs)


def simulate_together(grid: Grid, drives: Sequence[Outputs], of: Sequence[int], cases: Sequence[Case]) -> FloatArray:
    """Simulate cases of several recordings as if these were one (``go_together``)."""
    records, first = [outputs[0] for outputs in drives], drives[0][0]
    wanted = np.array([output_state(each, grid.structure) for each in drives[0]])
    given = inputs_of(records, of, cases)
    count_samples(len(cases) * given.torque.shape[1])
    out = np.empty((len(cases), wanted.size, given.torque.shape[1]))
    side_by_side.integrate_each(
        MASSES[grid.structure],
        (),
        first.sample_time_s,
        grid.substeps,
        grid.sign_width,
        first.since_start_s[0],
        given.torque,
        given.load,
        given.fed_by,
        given.loaded_by,
        np.zeros(out.shape[-1]),
        np.zeros(0),
        given.p,
        given.state,
        wanted,
        is_sensed(first, wanted[0]),
        out,
        np.zeros((len(cases), 2, 0)),
        np.zeros(len(cases), dtype=np.int64),
    )
    out /= np.array([[each.unit for each in drives[i]] for i in of])[:, :, np.newaxis]
    return out


class Stepper:
    """Advances a driveline by one period of constant torque at a time."""

    def __init__(
        self, model: DrivelineModel, period_s: float, load_torque_nm: float = 0.0, speed_rad_s: float = 0.0
    ) -> None:
        self._masses = MASSES[model.structure]
        self._p = flat(model)
        if laws := [law for law in model.laws if law.is_active(self._p)]:
            raise BadModel(
                f"effects.{laws[0]}: expected effects of the catalogue, got a law of your own, which a simulated "
                "rig can't have. Take it out of the model file."
            )
        self._period_s = period_s
        self._substeps = FINER * substeps_for(model.values(), period_s)
        history = int(np.ceil(self._p[slot(TRANSPORT_DELAY.name, "delay_s")] / period_s)) + 2
        self._steps = 0
        self._states_of_torque = begun_states(self._p)
        self._torque = np.zeros(history)
        self._load = np.full(history, load_torque_nm)
        self._angle = np.zeros(history)
        self._outputs, self._out = np.array([state_vector.SPEED]), np.zeros((1, history))
        self._slopes = np.zeros((2, 0))
        start = InitialCondition(
            load_torque_nm, 0.0, speed_rad_s, load_speed_rad_s=speed_rad_s, middle_speed_rad_s=speed_rad_s
        )
        self._state = initial_state(start, 0.0, 0.0, self._p)

    @property
    def speed_rad_s(self) -> float:
        """Motor speed now, as the sensor shows it [rad/s]."""
        state = self._state
        speed, filtered = state[state_vector.SPEED], state[state_vector.FILTERED]
        return float(sensing.shown(speed, self._read_angle(), filtered, self._p))

    @property
    def angle_rad(self) -> float:
        """Motor angle now [rad]."""
        return float(self._state[state_vector.ANGLE])

    def step(self, *torque_nm: float) -> None:
        """Let the torque of each input [Nm] act for one period."""
        now = np.array([self._steps * self._period_s])
        self._torque[:-1] = self._torque[1:]
        on_shaft, self._states_of_torque = shaft_torque_from(
            np.array([torque_nm]), now, self._period_s, self._p, self._states_of_torque
        )
        self._torque[-1] = on_shaft[0]
        self._angle[-1] = self._read_angle()
        self._angle[-2] = self._angle[-1] - self._state[state_vector.SPEED] * self._period_s  # it goes straight on
        last = self._torque.size - 1
        integration.integrate_period(
            self._masses,
            (),
            self._period_s,
            self._substeps,
            SIGN_WIDTH_RAD_S,
            last,
            last + 1,
            (self._steps - last) * self._period_s,
            self._torque,
            self._load,
            self._angle,
            np.zeros(0),
            self._p,
            self._state,
            self._outputs,
            False,
            self._out,
            self._slopes,
        )
        self._steps += 1

    def _read_angle(self) -> float:
        """Return the motor angle that the resolver gives now [rad]: laws that are periodic in it know no other."""
        return float(sensing.read_angle(self._state[state_vector.ANGLE], self._p))
