"""What a model says of recordings before any fit: whether they excite it beyond their noise, and what is odd in it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from scipy.signal import detrend

from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.preconditions.inertia import driven
from estimator.diagnosis.thresholds import Inertias, Recordings
from estimator.errors import NotExciting
from estimator.physics.layout import Grid, grid_for
from estimator.physics.model import DrivelineModel, Structure, natural_frequencies_rad_s
from estimator.signals.record import FloatArray, Record

UNREAD = ", and that every torque is read: what another one does counts as noise."


def model_warnings(model: DrivelineModel) -> list[str]:
    """Return what is odd about a model's values, one sentence each; values that can't be are refused by the model."""
    values = model.values()
    damping = _damping(values) if model.structure is Structure.TWO_MASS else []
    return [*_inertias({name: value for name, value in values.items() if name.startswith("J")}), *damping]


def _inertias(values: Mapping[str, float]) -> list[str]:
    small, large = min(values, key=values.__getitem__, default=""), max(values, key=values.__getitem__, default="")
    if small == large or values[large] < Inertias.UNEQUAL * values[small]:
        return []
    return [
        f"model: {small} = {values[small]:g} and {large} = {values[large]:g} differ by a factor of "
        f"{values[large] / values[small]:.3g}; the smaller one can hardly be seen. Are both reflected to the motor "
        "shaft and in the same unit?"
    ]


def _damping(values: Mapping[str, float]) -> list[str]:
    first = float(natural_frequencies_rad_s(values)[0])
    ratio = 0.5 * values["c"] * first / values["k"]  # of the relative motion of two masses: 2 zeta w_0 = c w_0^2 / k
    if ratio < 1.0:
        return []
    return [
        f"model: with c = {values['c']:g} and k = {values['k']:g} the first mode ({first / (2.0 * math.pi):.3g} Hz) is "
        f"damped {ratio:.3g} times critically: the line does not oscillate. Are k and c in the right unit and order?"
    ]


def require_excitation(records: Sequence[Record], model: DrivelineModel) -> list[str]:
    """Refuse recordings in which nothing moves beyond the noise; warn where only a part of the model is excited.

    What the torque does to the output is asked of the nominal model. A part of it that stays below the noise of the
    reading is not excited: whatever is fitted there is fitted to noise.
    """
    floor = noise_floor(records)
    moved = _rms([_good(record, record.output) for record in records])
    excited = math.sqrt(max(moved**2 - floor**2, 0.0))
    unit = records[0].kind.value
    if excited < floor:
        raise NotExciting(
            f"the {unit} moves by {excited:.3g} (rms) beyond a noise of {floor:.3g}, expected more than the noise. "
            f"Excite the driveline (PRBS, reversal, tip-in){UNREAD}",
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
            f"{floor:.3g}: the torque read excites nothing. Excite the driveline (PRBS, reversal, tip-in), check that "
            f"the torque is in Nm (force: N){UNREAD}",
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
    answer = _rms([_good(record, driven(record, line, grid, Recordings.NEAR_MODE * first_hz)) for record in records])
    if answer >= floor:
        return []
    return [
        f"at and above the model's first mode ({first_hz:.3g} Hz) the torque moves the {records[0].kind.value} by "
        f"{answer:.3g} (rms), less than its noise of {floor:.3g}: {lacking}. Superpose a PRBS, or a tip-in."
    ]


def _good(record: Record, signal: FloatArray) -> FloatArray:
    """Return a signal's good samples without mean and trend."""
    return detrend(signal[record.okay])


def _rms(signals: Sequence[FloatArray]) -> float:
    return math.sqrt(sum(float(signal @ signal) for signal in signals) / sum(signal.size for signal in signals))
