"""Whether recordings hold anything to diagnose: samples, a torque that changes, a motion beyond the noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import detrend

from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.preconditions.driven import driven
from estimator.errors import NotExciting
from estimator.physics.grid import Grid, grid_for
from estimator.physics.model import DrivelineModel, natural_frequencies_rad_s
from estimator.signals.record import FloatArray, Record

FEWEST_SAMPLES = 200
"""Fewer good samples than this do not carry a model with a dozen unknowns and its hold-out."""

NEAR_MODE = 0.7
"""From this share of the first natural frequency on a line answers otherwise than one body: by ``1 / (1 - 0.7^2)``,
twice as much."""


def require_signals(record: Record) -> None:
    """Refuse a recording with too few good samples, or of which torque or output does not change.

    Raises
    ------
    NotExciting
        Naming the recording.
    """
    good = int(record.okay.sum())
    if good < FEWEST_SAMPLES:
        raise NotExciting(
            f"recording {record.name}: {good} good samples, expected at least {FEWEST_SAMPLES}. Record longer.",
            (record.name,),
        )
    driven_by = ("torque", record.total_torque_nm) if record.imposed is None else ("imposed motion", record.imposed)
    for what, values in (driven_by, ("output", record.output)):
        seen = values[record.okay]
        if float(np.ptp(seen)) == 0.0:
            raise NotExciting(
                f"recording {record.name}: the {what} is constant at {seen[0]:g}, expected it to vary. "
                "Excite the driveline (PRBS, reversal, tip-in) and check the channel.",
                (record.name,),
            )


def require_excitation(records: Sequence[Record], model: DrivelineModel) -> list[str]:
    """Refuse recordings in which nothing moves beyond the noise; warn where only a part of the model is excited.

    What the torque does to the output is asked of the nominal model. A part of it that stays below the noise of the
    reading is not excited: whatever is fitted there is fitted to noise.

    Raises
    ------
    NotExciting
        Where output or torque excites nothing in any recording.
    """
    floor = noise_floor(records)
    moved = _rms([_good(record, record.output) for record in records])
    excited = math.sqrt(max(moved**2 - floor**2, 0.0))
    unit = records[0].kind.value
    if excited < floor:
        raise NotExciting(
            f"the {unit} moves by {excited:.3g} (rms) beyond a noise of {floor:.3g}, expected more than the noise. "
            "Excite the driveline (PRBS, reversal, tip-in).",
            tuple(record.name for record in records),
        )
    if records[0].imposed is not None:  # no torque that could be too small
        return []
    line = replace(model, effects={})
    grid = grid_for(line, records)
    answer = _rms([_good(record, driven(record, line, grid)) for record in records])
    if answer < floor:
        raise NotExciting(
            f"by the nominal model the torque moves the {unit} by {answer:.3g} (rms), less than its noise of "
            f"{floor:.3g}: the torque excites nothing. Excite the driveline (PRBS, reversal, tip-in), and check that "
            "the torque is in Nm (force: N).",
            tuple(record.name for record in records),
        )
    return _unexcited_mode(records, line, grid, floor)


def _unexcited_mode(records: Sequence[Record], line: DrivelineModel, grid: Grid, floor: float) -> list[str]:
    first_hz = float(natural_frequencies_rad_s(line.values())[0]) / (2.0 * math.pi)
    if first_hz == 0.0:
        return []
    lacking = "stiffness, damping and effects of the shaft can't be determined from these recordings"
    nyquist_hz = 0.5 / records[0].sample_time_s
    if nyquist_hz < first_hz:
        return [
            f"the model's first mode is at {first_hz:.3g} Hz, beyond the {nyquist_hz:.3g} Hz that a sampling period of "
            f"{records[0].sample_time_s:g} s can show: {lacking}. Sample faster, or use structure = 'one_mass'."
        ]
    answer = _rms([_good(record, driven(record, line, grid, NEAR_MODE * first_hz)) for record in records])
    if answer >= floor:
        return []
    return [
        f"at and above the model's first mode ({first_hz:.3g} Hz) the torque moves the {records[0].kind.value} by "
        f"{answer:.3g} (rms), less than its noise of {floor:.3g}: {lacking}. Superpose a PRBS, or a tip-in."
    ]


def _good(record: Record, signal: FloatArray) -> FloatArray:
    """Return a signal's good samples without mean and trend."""
    good: FloatArray = detrend(signal[record.okay])
    return good


def _rms(signals: Sequence[FloatArray]) -> float:
    return math.sqrt(sum(float(signal @ signal) for signal in signals) / sum(signal.size for signal in signals))
