"""Free-run simulation of one recording: measured torques in, simulated output out, nothing fed back."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimator.errors import BadModel
from estimator.physics import kernel
from estimator.physics.model import DrivelineModel, Structure
from estimator.physics.motion import reverses, speed_scale
from estimator.signals.record import FloatArray, Location, OutputKind, Record

RADIANS_PER_STEP = 0.15
"""Integration step in radians of the line's natural frequency, or its fastest decay: fourth order leaves 1e-6 of
amplitude per step."""

FASTEST_IN_NYQUIST = 30.0
"""Fastest mode that is simulated, in multiples of the Nyquist frequency of the sample time.

A line that stiff differs from a rigid one by 1 / 30^2, a thousandth, at the highest frequency a recording holds:
simulating a faster mode takes ever more integration steps and changes nothing that can be seen.
"""

SIGN_WIDTH = 0.01
"""Dry friction changes sign within this share of the top speed of recordings that pass through standstill.

Real contacts give way a little before they slip; and a sharper edge makes the error a jagged function of the
parameters: on a real drive fits from different starts then ended up to 10 % apart in friction, with this width not.
"""

_MASSES = {Structure.ONE_MASS: 1, Structure.TWO_MASS: 2}

_OUTPUT_STATE = {
    (OutputKind.SPEED, Location.MOTOR): kernel.SPEED,
    (OutputKind.SPEED, Location.LOAD): kernel.LOAD_SPEED,
    (OutputKind.POSITION, Location.MOTOR): kernel.ANGLE,
}


@dataclass(frozen=True, slots=True)
class Grid:
    """How a model is integrated on a set of recordings: sub-steps per period and width of a sign change."""

    structure: Structure
    substeps: int
    sign_width: float


@dataclass(frozen=True, slots=True)
class Start:
    """What is unknown in every recording: constant load torque [Nm] and initial state [rad, rad/s]."""

    load_torque_nm: float
    angle_rad: float
    speed_rad_s: float
    twist_rad: float = 0.0
    load_speed_rad_s: float = 0.0


def natural_frequency_rad_s(values: Mapping[str, float]) -> float:
    """Return the undamped natural frequency of the line, sqrt(k (1/J_M + 1/J_L)) [rad/s]; 0 for one mass."""
    if "k" not in values:
        return 0.0
    return math.sqrt(values["k"] * (1.0 / values["J_M"] + 1.0 / values["J_L"]))


def substeps_for(values: Mapping[str, float], period_s: float) -> int:
    """Return the integration steps per period that the line's natural frequency, or its fastest decay, needs.

    Raises
    ------
    BadModel
        Where that is beyond `FASTEST_IN_NYQUIST`.
    """
    motor = (values["b_M"] + values.get("c", 0.0)) / values["J_M"]
    load = (values["b_L"] + values["c"]) / values["J_L"] if "k" in values else 0.0
    fastest = max(natural_frequency_rad_s(values), motor + load)
    if fastest * period_s > FASTEST_IN_NYQUIST * math.pi:
        raise BadModel(_too_fast(values, fastest, period_s))
    return max(1, math.ceil(fastest * period_s / RADIANS_PER_STEP))


def _too_fast(values: Mapping[str, float], fastest_rad_s: float, period_s: float) -> str:
    """Say which mode is too fast, and for which parameters to look: the largest part of it and what it acts on."""
    if natural_frequency_rad_s(values) == fastest_rad_s:
        mode, law = "natural frequency", "k"
    else:
        parts = {"b_M": values["b_M"] / values["J_M"]}
        if "k" in values:
            parts |= {"b_L": values["b_L"] / values["J_L"], "c": values["c"] / min(values["J_M"], values["J_L"])}
        mode, law = "fastest decay", max(parts, key=parts.__getitem__)
    both = [name for name in ("J_M", "J_L") if name in values]
    inertia = {"b_M": "J_M", "b_L": "J_L"}.get(law) or min(both, key=values.__getitem__)
    return (
        f"parameters.{law} = {values[law]:g} with parameters.{inertia} = {values[inertia]:g}: the line's {mode} is "
        f"{fastest_rad_s / (2.0 * math.pi):.4g} Hz, expected at most {0.5 * FASTEST_IN_NYQUIST / period_s:.4g} Hz at "
        f"a sample time of {period_s:g} s ({FASTEST_IN_NYQUIST:g} times what it can show). Check both values and "
        "their units; a line that is rigid is structure = 'one_mass'."
    )


def grid_for(model: DrivelineModel, records: Sequence[Record]) -> Grid:
    """Choose the integration grid for a model on a set of recordings of one sampling period."""
    substeps = substeps_for(model.values(), records[0].sample_time_s)
    return Grid(model.structure, substeps, SIGN_WIDTH * _slow_scale(records))


def _slow_scale(records: Sequence[Record]) -> float:
    """Return the top speed of the recordings that reverse, or of all where none does [rad/s]."""
    return speed_scale([record for record in records if reverses(record)] or records)


def output_state(record: Record, structure: Structure) -> int:
    """Return the index of the state a recording measures.

    Raises
    ------
    BadModel
        Where the structure has no such output.
    """
    index = _OUTPUT_STATE.get((record.kind, record.location))
    if index is None or (structure is Structure.ONE_MASS and record.location is Location.LOAD):
        raise BadModel(
            f"recording {record.name}: {record.kind.value} at the {record.location.value} is no output of "
            f"{structure.value}. Expected speed at the motor, position at the motor, or (two_mass) speed at the load."
        )
    return index


def simulate(
    grid: Grid,
    record: Record,
    p: FloatArray,
    start: Start,
    extra_load_nm: FloatArray | None = None,
    output: int | None = None,
) -> FloatArray:
    """Simulate the recorded output from the recorded torque.

    Parameters
    ----------
    p : ndarray, shape (layout.SIZE,)
        Parameters of the superset model.
    extra_load_nm : ndarray, shape (N,), optional
        Load torque over time, beside the constant one.
    output : int, optional
        State to return (``kernel.SPEED`` ...); the recorded output by default.

    Returns
    -------
    ndarray, shape (N,)
        In the unit of ``record.output``.
    """
    torque = record.total_torque_nm
    load = np.full(torque.shape, start.load_torque_nm)
    if extra_load_nm is not None:
        load += extra_load_nm
    state = np.array([start.angle_rad, start.speed_rad_s, start.twist_rad, start.load_speed_rad_s, torque[0]])
    out = np.empty_like(torque)
    kernel.integrate(
        _MASSES[grid.structure],
        record.sample_time_s,
        grid.substeps,
        grid.sign_width,
        0,
        torque,
        load,
        p,
        state,
        output_state(record, grid.structure) if output is None else output,
        out,
    )
    return out
