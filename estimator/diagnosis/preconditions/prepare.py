"""Preparation of recordings for a diagnosis: whether they belong together, excite anything, and what is left out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import detrend

from estimator.diagnosis.acquisition import as_if_not_lost
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.preconditions.channels import unwrapped, with_usable_channels, without_clipped
from estimator.diagnosis.preconditions.inertia import driven, model_warnings
from estimator.diagnosis.preconditions.thinned import thinned, with_room, without_not_read
from estimator.diagnosis.preconditions.units import require_plausible_units
from estimator.diagnosis.result import Diagnosis
from estimator.diagnosis.segments import Cut, cut, joined
from estimator.errors import BadShape, Implausible, NotExciting
from estimator.physics.grid import Grid, grid_for
from estimator.physics.model import DrivelineModel, natural_frequencies_rad_s
from estimator.physics.simulate import output_state
from estimator.signals.outputs import outputs_apart
from estimator.signals.record import FloatArray, Record

FEWEST_SAMPLES = 200
"""Fewer good samples than this do not carry a model with a dozen unknowns and its hold-out."""

NEAR_MODE = 0.7
"""From this share of the first natural frequency on a line answers otherwise than one body: by ``1 / (1 - 0.7^2)``,
twice as much."""


def require_signals(record: Record) -> None:
    """Refuse a recording with too few good samples, or of which torque or output does not change."""
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


SAME_PERIOD = 1e-3
"""Relative difference of sampling periods that rounding of time stamps makes."""


def require_together(records: Sequence[Record]) -> None:
    """Refuse recordings that do not belong together."""
    if not records:
        raise BadShape("no recording was given, expected at least one")
    first = records[0]
    names = [record.name for record in records]
    if len(set(names)) < len(names):
        raise BadShape(f"recordings must have different names, got {', '.join(names)}. Rename the files.")
    for record in records[1:]:
        if not np.isclose(record.sample_time_s, first.sample_time_s, rtol=SAME_PERIOD):
            raise BadShape(
                f"recording {record.name}: sampling period {record.sample_time_s:g} s, expected "
                f"{first.sample_time_s:g} s as in {first.name}. Diagnose recordings of one period together."
            )
        if (record.kind, record.location) != (first.kind, first.location):
            raise BadShape(
                f"recording {record.name}: output is {record.kind.value} at the {record.location.value}, expected "
                f"{first.kind.value} at the {first.location.value} as in {first.name}."
            )
        if record.torque_nm.shape[1] != first.torque_nm.shape[1]:
            raise BadShape(
                f"recording {record.name}: {record.torque_nm.shape[1]} torque inputs, expected "
                f"{first.torque_nm.shape[1]} as in {first.name}. Give every recording the same inputs."
            )


@dataclass(frozen=True, slots=True)
class Prepared:
    """Recordings fit for a diagnosis: cut at long gaps, without what was cut off, with what there is to say of them."""

    records: tuple[Record, ...]
    holdout: tuple[Record, ...]
    warnings: tuple[str, ...]
    segments: Cut

    def finished(self, diagnosis: Diagnosis) -> Diagnosis:
        """Return a diagnosis of these records under the recordings' own names, with the warnings."""
        whole = joined(diagnosis, self.segments)
        return replace(whole, warnings=(*self.warnings, *whole.warnings))


def as_moved(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Return recordings without what no sensor has read, and what there is to say of it."""
    warnings: list[str] = []
    mended = list(records)
    for mend in (unwrapped, without_clipped, without_not_read, with_usable_channels):
        mended, said = mend(mended)
        warnings += said
    return mended, warnings


def require_plausible(records: Sequence[Record], model: DrivelineModel) -> list[Implausible]:
    """Refuse recordings that can't be of a model, as a diagnosis does, and return what is doubtful."""
    mended, _ = as_moved(records)
    return _plausible(cut(thinned(mended, model)), model)


def _plausible(segments: Cut, model: DrivelineModel) -> list[Implausible]:
    """Refuse segments that can't be of a model by their recordings' names, and return what is doubtful."""

    def of_recording(found: Implausible) -> Implausible:
        cure = found.cure
        return Implausible(str(found), cure and replace(cure, recording=segments.origin[cure.recording]))

    try:
        return [of_recording(doubt) for doubt in require_plausible_units(as_if_not_lost(segments.records), model)]
    except Implausible as error:
        raise of_recording(error) from None


def prepare(records: Sequence[Record], model: DrivelineModel, holdout: Sequence[Record] = ()) -> Prepared:
    """Check and mend recordings before anything is fitted."""
    require_together([*records, *holdout] if records else records)
    mended, warnings = as_moved([*records, *holdout])
    for record in mended:
        for each in outputs_apart([record], lambda _: 1.0):
            output_state(each, model.structure)
        require_signals(record)
    names = [record.name for record in records]
    segments, few = with_room(cut(thinned(mended, model)), names)
    training = segments.of(names)
    if not training:
        raise NotExciting(" ".join(segments.warnings), tuple(names))
    warnings += map(str, _plausible(segments, model))
    warnings += [*model_warnings(model), *segments.warnings, *few, *require_excitation(as_if_not_lost(training), model)]
    unseen = segments.of(record.name for record in holdout)
    return Prepared(training, unseen, tuple(warnings), segments)
