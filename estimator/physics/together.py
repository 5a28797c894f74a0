"""Several recordings simulated as if they were one: their simulations fill the lanes of the kernel together."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

import numpy as np

from estimator.lanes import LANES
from estimator.physics.grid import Grid
from estimator.physics.inputs import Case, inputs_of
from estimator.physics.kernel import many, side_by_side
from estimator.physics.model import Structure
from estimator.physics.parallel import PARTS, concurrently
from estimator.physics.simulate import MASSES, PERIODIC, TIMED, is_sensed, is_steep, output_state, simulate_outputs
from estimator.physics.work import count
from estimator.signals.record import FloatArray, Record

LENGTHS_DIFFER = 1.1
"""Length of the longest recording over the mean of all from which they go each by itself: the others would continue to
its end."""

Outputs = Sequence[Record]
"""A recording's measured outputs, each as a recording of one output (``signals.outputs``)."""


def simulate_records(grid: Grid, drives: Sequence[Outputs], cases: Sequence[Case]) -> list[FloatArray]:
    """Simulate every output of several recordings, a case of each: side by side where they can be, else on all cores.

    Returns
    -------
    list of ndarray, shape (C_i, N_i)
        Of each recording.
    """
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
    if len({_make(outputs) for outputs in drives}) > 1 or any(is_steep(each) for outputs in drives for each in outputs):
        return False
    begin_alike = len({outputs[0].since_start_s[0] for outputs in drives}) == 1
    if acts[PERIODIC].any() or not (begin_alike or not acts[TIMED].any()):
        return False
    return side_by_side.go_side_by_side(MASSES[grid.structure], p, np.arange(len(lines)))


def _make(outputs: Outputs) -> tuple[object, ...]:
    """Return what recordings that are simulated as if they were one have in common."""
    return outputs[0].sample_time_s, *((each.kind, each.location, each.lead is None) for each in outputs)


def simulate_together(grid: Grid, drives: Sequence[Outputs], of: Sequence[int], cases: Sequence[Case]) -> FloatArray:
    """Simulate cases of several recordings as if these were one (``go_together``).

    Parameters
    ----------
    of : sequence of int
        Which of the recordings each case is of.

    Returns
    -------
    ndarray, shape (len(cases), C, N)
        As long as the longest recording; shorter ones continue under the torques they ended with.
    """
    records, first = [outputs[0] for outputs in drives], drives[0][0]
    wanted = np.array([output_state(each, grid.structure) for each in drives[0]])
    given = inputs_of(records, of, cases)
    out = np.empty((len(cases), wanted.size, given.torque.shape[1]))
    count(len(cases) * given.torque.shape[1])
    many.integrate_each(
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
