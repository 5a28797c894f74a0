"""From recordings as given to recordings that can be diagnosed: refused, masked or thinned."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import detrend

from estimator.diagnosis.acquisition.chain import without_lost_samples
from estimator.diagnosis.acquisition.finding import runs
from estimator.diagnosis.noise import noise_floor, share_of
from estimator.diagnosis.preconditions.agreement import disagreements
from estimator.diagnosis.preconditions.channels import standstill, unwrapped, with_usable_channels, without_clipped
from estimator.diagnosis.preconditions.inertia import driven, model_warnings
from estimator.diagnosis.preconditions.plausible import doubts_about
from estimator.diagnosis.result import Diagnosis, Doubt
from estimator.diagnosis.segments import Cut, cut, joined, segments
from estimator.diagnosis.thresholds import Mistakes, Recordings
from estimator.errors import BadShape, NotExciting, made_of_each
from estimator.physics.layout import Grid, grid_for
from estimator.physics.model import DrivelineModel, Structure, natural_frequencies_rad_s
from estimator.physics.parallel import TimeIsUp
from estimator.physics.simulate import output_state
from estimator.signals.record import BoolArray, Channel, FloatArray, OutputKind, Record, separated_outputs, sliced

SEED = 1

TURN = 2.0 * np.pi

UNREAD = ", and that every torque is read: what another one does counts as noise."


@dataclass(frozen=True, slots=True)
class NotRead:
    """Rows of a channel that no sensor has read, shape (N,), and what is there instead."""

    channel: str  # in words, for a warning
    rows: BoolArray  # where it was not read
    held: bool  # the value before stands there; else it is interpolated


def not_read(channel: str, values: FloatArray, seen: BoolArray, may_rest: bool) -> list[NotRead]:
    """Return the rows in which a channel is interpolated, and those in which it is held at one value."""
    whole = seen[:-2] & seen[1:-1] & seen[2:]
    steps = np.abs(np.diff(values))
    if not whole.any() or not (steps > 0.0).any():
        return []
    rounding = max(
        Recordings.ROUNDING * float(steps[steps > 0.0].min()), Recordings.SMOOTH * float(np.ptp(values[seen]))
    )
    bend = np.abs(np.diff(values, 2))
    bent = bend[whole & (bend > rounding)]
    usual = float(np.median(bent)) if bent.size else 0.0
    if usual < Recordings.BENT * rounding:
        return []
    drawn, held = np.zeros_like(seen), np.zeros_like(seen)
    for first, behind in runs(whole & (bend <= rounding)):
        rows = slice(first, behind + 2)  # a triple has two rows more
        if behind + 2 - first < Recordings.FEWEST_IN_A_ROW:
            continue
        moved = float(np.ptp(values[rows]))
        drawn[rows] |= moved >= usual
        held[rows] |= moved == 0.0 and values[first] != 0.0
    if may_rest or float(np.mean(steps[~(held[1:] & held[:-1])] == 0.0)) > Recordings.SELDOM:
        held[:] = False
    return [NotRead(channel, rows, rows is held) for rows in (drawn, held) if rows.any()]


def without_not_read(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Mask the rows in which the output was not read; say so.

    A torque that lies on straight lines may be one that was commanded: ramps, and levels.
    """
    mended, warnings = [], []
    for record in records:
        okay = record.okay.copy()
        seen = record.okay & np.isfinite(record.output)
        for found in not_read(record.kind.value, record.output, seen, record.kind is not OutputKind.SPEED):
            okay &= ~found.rows
            what = "stands still to the last digit" if found.held else "lies on straight lines to the last digit"
            why = "its reading had stopped" if found.held else "it was interpolated, not read"
            warnings.append(
                f"recording {record.name}: the {found.channel} {what} in {found.rows.mean():.1%} of the rows: {why} "
                "there; these rows are not used. Give the raw recording, with its gaps."
            )
        mended.append(record if np.array_equal(okay, record.okay) else replace(record, okay=okay))
    return mended, warnings


def shortened_to_memory(segments: Cut, training: Iterable[str]) -> tuple[Cut, list[str]]:
    """Leave out pieces of the recordings that are fitted, as many as a fit can't hold; say which are used."""
    pieces = segments.of(training)
    used = list(pieces)
    while (size := _size(used)) > Recordings.MOST_SAMPLES_TIMES_RECORDINGS and len(used) > 1:
        used = _some(pieces, min(int(len(used) * sqrt(Recordings.MOST_SAMPLES_TIMES_RECORDINGS / size)), len(used) - 1))
    if len(used) == len(pieces):
        return segments, []
    left_out = {piece.name for piece in pieces} - {piece.name for piece in used}
    kept = tuple(record for record in segments.records if record.name not in left_out)
    return replace(segments, records=kept), [_warning(used, pieces)]


def _size(pieces: Sequence[Record]) -> int:
    return len(pieces) * sum(int(piece.output.shape[0]) for piece in pieces)


def _some(pieces: Sequence[Record], count: int) -> list[Record]:
    """Return one of each of so many equal parts of the list, at least one in all."""
    edges = np.linspace(0, len(pieces), max(count, 1) + 1).astype(int)
    return [pieces[i] for i in np.random.default_rng(SEED).integers(edges[:-1], edges[1:])]


def _warning(used: Sequence[Record], pieces: Sequence[Record]) -> str:
    return (
        f"{len(used)} of {len(pieces)} recordings are used (each piece between long gaps, or stretch of a long one, "
        f"counts as one), drawn from the whole list: {', '.join(piece.name for piece in used)}. Each has unknowns of "
        "its own, so more would take gigabytes. Give those that matter, and the others by --holdout."
    )


def thinned(records: Sequence[Record], model: DrivelineModel) -> list[Record]:
    """Return recordings with as many samples as the model's fastest mode needs; those that have no more as they are."""
    if share_of(records) >= 1.0 or model.structure is Structure.JOINT:
        return list(records)
    return [thin(record, factor_for([record], model)) for record in records]


def as_slow_as_needed(records: Sequence[Record], model: DrivelineModel) -> list[Record]:
    """Return recordings with no more samples than the line can answer to: between them only the sensor is seen."""
    shortest = min(record.okay.size for record in records)
    factor = min(factor_for(records, model, Recordings.LONGEST_OF_RIGID_S), max(shortest // Recordings.FEWEST_KEPT, 1))
    return [thin(record, factor) for record in records]


def factor_for(records: Sequence[Record], model: DrivelineModel, longest_s: float = Recordings.LONGEST_S) -> int:
    """Return one in how many samples is enough for recordings of one sampling period."""
    joint = model.structure is Structure.JOINT
    fastest_hz = max(map(_band_hz, records)) if joint else float(natural_frequencies_rad_s(model.values())[-1]) / TURN
    if fastest_hz > 0.0:
        longest_s = min(longest_s, 1.0 / (Recordings.PER_PERIOD * fastest_hz))
    return max(1, int(longest_s / records[0].sample_time_s * (1.0 + 1e-9)))


def _band_hz(record: Record) -> float:
    """Return the frequency below which nearly all the power of an output is [Hz]."""
    output = np.where(record.okay, record.output, np.mean(record.output[record.okay]))
    power = np.cumsum(np.abs(np.fft.rfft(output - output.mean())) ** 2)
    index = int(np.searchsorted(power, Recordings.BAND_POWER * power[-1]))
    return float(np.fft.rfftfreq(output.size, record.sample_time_s)[index])


def thin(record: Record, factor: int) -> Record:
    """Return a recording with one in ``factor`` of its samples."""
    if factor == 1:
        return record
    count = record.okay.size // factor
    kept = slice(0, count * factor, factor)
    trusted = np.asarray(_blocks(record.torque_trusted, factor).all(axis=1))
    return replace(
        record,
        sample_time_s=factor * record.sample_time_s,
        time_s=record.time_s[kept],
        torque_nm=_blocks(record.torque_nm, factor).mean(axis=1),
        output=record.output[kept],
        okay=record.okay[kept],
        torque_okay=None if record.torque_okay is None else trusted,
        offset_s=None if record.offset_s is None else record.offset_s[kept],
        imposed=None if record.imposed is None else record.imposed[kept],
        reference_nm=None if record.reference_nm is None else _blocks(record.reference_nm, factor).mean(axis=1),
        load_nm=None if record.load_nm is None else _blocks(record.load_nm, factor).mean(axis=1),
        channels=_kept(record.channels, kept),
        unused=_kept(record.unused, kept),
    )


def _kept(channels: Sequence[Channel], rows: slice) -> tuple[Channel, ...]:
    return tuple(replace(each, output=each.output[rows], okay=each.okay[rows]) for each in channels)


def _blocks(values: NDArray[Any], factor: int) -> NDArray[Any]:
    count = values.shape[0] // factor
    return values[: count * factor].reshape(count, factor, *values.shape[1:])


def require_signals(record: Record) -> None:
    """Refuse a recording with too few good samples, or of which torque or output does not change."""
    good = int(record.okay.sum())
    if good < Recordings.FEWEST_SAMPLES:
        raise NotExciting(
            f"recording {record.name}: {good} good samples, expected at least {Recordings.FEWEST_SAMPLES}. Record "
            "longer.",
            (record.name,),
        )
    driven_by = ("torque", record.total_torque_nm) if record.imposed is None else ("imposed motion", record.imposed)
    still = standstill(record)
    for what, values in (driven_by, ("output", record.output)):
        seen = values[record.okay]
        if not still and float(np.ptp(seen)) == 0.0:
            still = (
                f"recording {record.name}: the {what} is constant at {seen[0]:g}, expected it to vary. "
                "Excite the driveline (PRBS, reversal, tip-in) and check the channel."
            )
    if still:
        raise NotExciting(still, (record.name,))


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


def require_together(records: Sequence[Record]) -> None:
    """Refuse recordings that do not belong together."""
    if not records:
        raise BadShape("no recording was given, expected at least one")
    first = records[0]
    names = [record.name for record in records]
    if len(set(names)) < len(names):
        raise BadShape(f"recordings must have different names, got {', '.join(names)}. Rename the files.")
    for record in records[1:]:
        if not np.isclose(record.sample_time_s, first.sample_time_s, rtol=Mistakes.SAME_PERIOD):
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

    records: tuple[Record, ...]  # to be fitted
    holdout: tuple[Record, ...]  # kept out of every fit
    warnings: tuple[str, ...]  # as sentences
    segments: Cut  # which part of which recording each record is
    doubts: tuple[Doubt, ...] = ()  # about the input

    def finished(self, diagnosis: Diagnosis) -> Diagnosis:
        """Return a diagnosis of these records under the recordings' own names, with their warnings."""
        whole = joined(diagnosis, self.segments)
        return replace(whole, warnings=(*self.warnings, *whole.warnings))


def with_motion_corrected(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Return recordings unwrapped and without what no sensor has read, and a warning for each change."""
    warnings: list[str] = []
    mended = list(records)
    for mend in (unwrapped, without_clipped, without_not_read, with_usable_channels):
        mended, notes = mend(mended)
        warnings += notes
    return mended, warnings


def doubtful(records: Sequence[Record], model: DrivelineModel | None) -> list[Doubt]:
    """Ask of recordings as they were read whether they can be of one drive, and of a model where there is one.

    The longest stretch of each is asked; where units and signs leave no doubt, also whether they are of one line.
    Raises `Implausible` where they can't be of a drive.
    """
    mended, _ = with_motion_corrected(records)
    thin_ones = mended if model is None else thinned(mended, model)
    doubts = doubts_about(without_lost_samples([_longest(record) for record in thin_ones]), model)
    if doubts or model is None:
        return doubts
    return disagreements(without_lost_samples([_longest(record) for record in mended]), model)


def _longest(record: Record) -> Record:
    return sliced(record, max(segments(record), key=lambda rows: int(record.okay[rows].sum())))


def prepare(records: Sequence[Record], model: DrivelineModel, holdout: Sequence[Record] = ()) -> Prepared:
    """Check and mend recordings before anything is fitted."""
    require_together([*records, *holdout] if records else records)
    mended, warnings = with_motion_corrected([*records, *holdout])
    for record in mended:
        for each in separated_outputs([record], lambda _: 1.0):
            output_state(each, model.structure)
    made_of_each(mended, require_signals, NotExciting, NotExciting)
    names = [record.name for record in records]
    pieces, few = shortened_to_memory(cut(thinned(mended, model)), names)
    training = pieces.of(names)
    if not training:
        raise NotExciting(" ".join(pieces.warnings), tuple(names))
    try:
        doubts = doubtful([*records, *holdout], model)
        unexcited = require_excitation(without_lost_samples(training), model)
    except TimeIsUp:  # nothing will be decided in any case
        doubts, unexcited = [], ["whether units and excitation are plausible was not looked at: the time was up"]
    warnings += [*model_warnings(model), *pieces.warnings, *few, *unexcited]
    unseen = pieces.of(record.name for record in holdout)
    return Prepared(training, unseen, tuple(warnings), pieces, tuple(doubts))
