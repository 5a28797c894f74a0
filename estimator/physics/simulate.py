"""Free-run simulation of one recording: measured torques in, simulated output out, nothing fed back."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

import numpy as np

from estimator.errors import BadModel
from estimator.lanes import LANES
from estimator.physics import catalogue, joint, own_law_run
from estimator.physics.grid import Grid
from estimator.physics.inputs import Case, inputs_of, load_of
from estimator.physics.kernel import integration, many, side_by_side, state_vector
from estimator.physics.kernel.makes import Masses
from estimator.physics.layout import slot
from estimator.physics.model import Structure
from estimator.physics.motion import motor_angle
from estimator.physics.parallel import PARTS, concurrently
from estimator.physics.start import Start
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

_SENSED = (state_vector.SPEED, state_vector.LOAD_SPEED)
"""What the effects of a speed sensor act on."""

LENGTHS_DIFFER = 1.1
"""Length of the longest recording over the mean of all from which they go each by itself: the others would continue to
its end."""


def output_state(record: Record, structure: Structure) -> int:
    """Return the index of the state a recording measures.

    Raises
    ------
    BadModel
        Where the structure has no such output.
    """
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


def _is_sensed(record: Record, output: int | None, wanted: int) -> bool:
    """Tell whether an output is read by the sensor that effects of the sensor are of: the first one of a recording."""
    return output is None and record.lead is None and wanted in _SENSED


def _is_slope(record: Record, output: int | None) -> bool:
    return output is None and record.kind is OutputKind.ACCELERATION


def simulate(
    grid: Grid,
    record: Record,
    p: FloatArray,
    start: Start,
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
    only: FloatArray = simulate_each(grid, record, [Case(p, start, extra_load_nm)], output)[0]
    return only


def simulate_each(
    grid: Grid,
    record: Record,
    cases: Sequence[Case],
    output: int | None = None,
    alike_s: FloatArray | None = None,
) -> FloatArray:
    """Simulate a recording several times; see ``simulate``.

    Parameters
    ----------
    alike_s : ndarray, shape (len(cases),), optional
        Time since the recording began up to which each case is as the first one [s]: it is simulated from there on.

    Returns
    -------
    ndarray, shape (len(cases), N)
    """
    wanted = output_state(record, grid.structure) if output is None else output
    if grid.plant is not None and output is None:
        return grid.plant.simulated(record, cases)
    if grid.structure is Structure.JOINT:
        imposed = joint.imposed_in(record)
        return np.array([_joint_output(record, imposed, case, wanted) for case in cases])
    if any(grid.active(case.p) for case in cases):
        return np.array([_under_laws(grid, record, case, wanted, output is None) for case in cases])
    given = inputs_of([record], [0] * len(cases), cases)
    shape = (len(cases), record.time_s.size)
    is_slope = _is_slope(record, output)
    steep = is_slope or (output is None and record.offset_s is not None)
    slopes = np.zeros((shape[0], 2, shape[1] if steep else 0))
    out = np.empty(shape)
    many.integrate_each(
        MASSES[grid.structure],
        record.sample_time_s,
        grid.substeps,
        grid.sign_width,
        record.since_start_s[0],
        given.torque,
        given.load,
        given.fed_by,
        given.loaded_by,
        _angle(record, given.p),
        given.p,
        given.state,
        wanted,
        _is_sensed(record, output, wanted),
        out,
        slopes,
        _samples_alike(record, len(cases), alike_s),
    )
    return _read(record, out, slopes, output)


def _read(record: Record, out: FloatArray, slopes: FloatArray, output: int | None) -> FloatArray:
    """Return what is read of outputs, shape (..., N), in the recording's own unit."""
    if output is not None:
        return out
    if _is_slope(record, output):  # of a torque held over each period the mean of both sides
        found: FloatArray = 0.5 * slopes.sum(axis=-2) / record.unit
        found[..., [0, -1]] = slopes[..., [1, 0], [0, -1]] / record.unit
        return found
    return _sampled_off_time(out, slopes, record.offset_s) / record.unit


def simulate_records(grid: Grid, records: Sequence[Record], cases: Sequence[Case]) -> list[FloatArray]:
    """Simulate several recordings, a case of each: side by side where they can be, else on all cores."""
    count = len(records)
    fill_lanes = 1 < count <= LANES or (count > LANES and are_of_a_length(records))
    if not fill_lanes or not go_together(grid, records, [case.p for case in cases]):
        return concurrently(lambda i: simulate_each(grid, records[i], [cases[i]])[0], range(count))
    parts = [range(count)[part] for part in lanes_filled(count)]
    runs = concurrently(lambda part: simulate_together(grid, records, part, [cases[i] for i in part]), parts)
    rows = (row for run in runs for row in run)
    return [row[: record.time_s.size] for row, record in zip(rows, records, strict=True)]


def lanes_filled(count: int, most: int = sys.maxsize) -> list[slice]:
    """Return so many simulations in parts that fill the lanes, more where only ``most`` lanefuls fit."""
    width = LANES * min(math.ceil(count / (PARTS * LANES)), most)
    return [slice(first, first + width) for first in range(0, count, width)]


def are_of_a_length(records: Sequence[Record]) -> bool:
    """Tell whether recordings that are simulated as if they were one all end at about the same time."""
    sizes = [record.time_s.size for record in records]
    return max(sizes) * len(sizes) <= LENGTHS_DIFFER * sum(sizes)


def go_together(grid: Grid, records: Sequence[Record], lines: Sequence[FloatArray], moved: Sequence[int] = ()) -> bool:
    """Tell whether several recordings can be simulated as if they were one.

    Parameters
    ----------
    lines : sequence of ndarray, shape (layout.SIZE,)
        Parameters of each recording's line.
    moved : sequence of int
        Places of parameters that may also have other values.
    """
    if grid.structure is Structure.JOINT or grid.plant is not None or any(grid.active(p) for p in lines):
        return False
    p = np.array(lines)
    acts = (p != 0.0).any(axis=0)
    acts[list(moved)] = True
    alike = len({(each.kind, each.location, each.lead is None, each.sample_time_s) for each in records}) == 1
    on_time = all(record.offset_s is None and not _is_slope(record, None) for record in records)
    begin_alike = len({record.since_start_s[0] for record in records}) == 1
    if not alike or not on_time or acts[PERIODIC].any() or not (begin_alike or not acts[TIMED].any()):
        return False
    return side_by_side.go_side_by_side(MASSES[grid.structure], p, np.arange(len(lines)))


def simulate_together(grid: Grid, records: Sequence[Record], of: Sequence[int], cases: Sequence[Case]) -> FloatArray:
    """Simulate cases of several recordings as if these were one (``go_together``).

    Parameters
    ----------
    of : sequence of int
        Which of the recordings each case is of.

    Returns
    -------
    ndarray, shape (len(cases), N)
        As long as the longest recording; shorter ones continue under the torques they ended with.
    """
    wanted, given = output_state(records[0], grid.structure), inputs_of(records, of, cases)
    out = np.empty((len(cases), given.torque.shape[1]))
    many.integrate_each(
        MASSES[grid.structure],
        records[0].sample_time_s,
        grid.substeps,
        grid.sign_width,
        records[0].since_start_s[0],
        given.torque,
        given.load,
        given.fed_by,
        given.loaded_by,
        np.zeros(out.shape[1]),
        given.p,
        given.state,
        wanted,
        _is_sensed(records[0], None, wanted),
        out,
        np.zeros((len(cases), 2, 0)),
        np.zeros(len(cases), dtype=np.int64),
    )
    out /= np.array([records[i].unit for i in of])[:, np.newaxis]
    return out


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


def _sampled_off_time(out: FloatArray, slopes: FloatArray, offset_s: FloatArray | None) -> FloatArray:
    """Return outputs (..., N) as they were when the samples were taken, off their time stamps [s]."""
    if offset_s is None or slopes.shape[-1] == 0:
        return out
    moved: FloatArray = out + np.where(offset_s < 0.0, slopes[..., 0, :], slopes[..., 1, :]) * offset_s
    return moved


def _joint_output(record: Record, imposed: joint.Imposed, case: Case, output: int) -> FloatArray:
    start, load = case.start, load_of(case, record)
    return joint.simulate(record, imposed, case.p, load, start.twist_rad, start.preload_nm, output)


def _under_laws(grid: Grid, record: Record, case: Case, output: int, recorded: bool) -> FloatArray:
    """Simulate with laws of a user's own: their torques are held over an integration step, which is a sample then."""
    laws, given = grid.active(case.p), inputs_of([record], [0], [case])
    torque, load, state = given.torque[0], given.load[0], given.state[0]
    angle, masses = _angle(record, given.p), MASSES[grid.structure]
    run = own_law_run.Run.of(masses, grid.substeps, grid.sign_width, record, torque, load, angle, case.p).under(
        laws, state
    )
    steep = recorded and (record.offset_s is not None or _is_slope(record, None))
    slopes = np.zeros((2, run.torque.size if steep else 0))
    out = np.empty_like(run.torque)
    integration.integrate(
        masses,
        run.step_s,
        1,
        grid.sign_width,
        0,
        record.since_start_s[0],
        run.torque,
        run.load,
        run.angle,
        case.p,
        state.copy(),
        output,
        recorded and _is_sensed(record, None, output),
        out,
        slopes,
    )
    if recorded and record.lead is None:
        out += run.misread(laws, state)
    every = grid.substeps
    return _read(record, out[::every], slopes[:, ::every], None if recorded else output)


TIMED = np.array([slot(e.name, e.parameters[0].name) for e in catalogue.BUILT_IN.values() if e.event or e.timed])
"""Sizes of the laws that depend on the time since a recording began."""

PERIODIC = np.array([slot(e.name, size) for e in catalogue.BUILT_IN.values() for size in e.phases.values()])
"""Amplitudes of the laws that are periodic in the motor's angle."""
