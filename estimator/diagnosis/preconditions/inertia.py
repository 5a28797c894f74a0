"""Inertia seen by torque and motion, against the model's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import detrend

from estimator.diagnosis.thresholds import Inertias, Mistakes
from estimator.errors import BadModel
from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import Grid, flat, grid_for
from estimator.physics.model import DrivelineModel, Parameter, Structure, natural_frequencies_rad_s
from estimator.physics.motion import measured_speed, turns_on
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, Record

BODY = DrivelineModel(Structure.ONE_MASS, {"J_M": Parameter(1.0, 0.0), "b_M": Parameter(0.0, 0.0)})
"""What any line is as a whole, where no model is known; its inertia says nothing."""


def driven(record: Record, line: DrivelineModel, grid: Grid, from_hz: float = 0.0, to_hz: float = np.inf) -> FloatArray:
    """Simulate the output that the torque of a band of frequencies makes from rest; shape (N,) [unit of the output].

    The torque is taken without its mean; above 0 Hz without its trend, too.
    """
    torque = record.total_torque_nm - record.total_torque_nm.mean()
    if from_hz > 0.0 or to_hz < np.inf:
        frequency = np.fft.rfftfreq(torque.size, record.sample_time_s)
        spectrum = np.fft.rfft(detrend(torque))
        spectrum[(frequency < from_hz) | (frequency > to_hz)] = 0.0
        torque = np.fft.irfft(spectrum, torque.size)
    alone = replace(record, torque_nm=torque[:, np.newaxis], load_nm=None, torque_okay=None, offset_s=None)
    return simulate(grid, alone, flat(line), InitialCondition(0.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class Inertia:
    """The inertia that a recording fits over the nominal one, negative where the speed falls with the torque.

    ``rest`` is the share of the motion that does not follow from the torque, ``log_ratio`` the logarithm of the ratio
    of the inertias seen below and above the first mode. Of a joint it is the torque that the motion takes.
    """

    ratio: float  # 1 where the model is right
    rest: float
    log_ratio: float = math.nan

    @property
    def tells(self) -> bool:
        """Whether enough of the motion follows from the torque for the ratio to mean anything."""
        return self.rest <= Inertias.TELLS and self.ratio != 0.0

    @property
    def falls(self) -> bool:
        """Whether the motion tells that it falls where the torque rises."""
        return self.tells and self.ratio < 0.0


NOTHING = Inertia(math.nan, 1.0)


def fitted_inertia(record: Record, line: DrivelineModel) -> Inertia:
    """Return the inertia that a recording fits: by both bands of a line with a mode, and as one body."""
    if record.imposed is not None:
        return _of_joint(record, line)
    first_hz = _first_hz(line)
    log_ratio, found, grid = math.nan, as_one_body(record, line, first_hz), _grid_or_none(record, line)
    if grid is not None and 0.0 < Inertias.ABOVE[0] * first_hz < 0.5 / record.sample_time_s:
        below = by_band(
            record, line, grid, Inertias.BELOW[0] * first_hz, Inertias.BELOW[1] * first_hz, Inertias.ONE_WAY
        )
        above = by_band(record, line, grid, Inertias.ABOVE[0] * first_hz, Inertias.ABOVE[1] * first_hz)
        if max(below.rest, above.rest) <= 1.0 - Inertias.BANDS_TELL:
            log_ratio = math.log(abs(below.ratio / above.ratio))
            mean = math.copysign(math.sqrt(abs(below.ratio * above.ratio)), below.ratio)
            if found.tells and abs(math.log(abs(found.ratio / mean))) > math.log(Inertias.AGREE):
                return replace(found, log_ratio=math.log(abs(found.ratio / above.ratio)))  # a load too heavy to show
            if abs(log_ratio) <= math.log(Inertias.AGREE):
                return Inertia(mean, min(below.rest, found.rest), log_ratio)  # comparable with that of one body alone
    return replace(found, log_ratio=log_ratio)


def _of_joint(record: Record, line: DrivelineModel) -> Inertia:
    """Return the torque that an imposed motion takes over what the nominal stiffness and damping make of it."""
    values, twist = line.values(), record.imposed
    assert twist is not None  # noqa: S101 - the caller asks of joints alone
    parts = twist, np.gradient(twist, record.sample_time_s)
    nominal = values["k"] * parts[0] + values["c"] * parts[1]
    nominal, taken = (each[record.okay] - each[record.okay].mean() for each in (nominal, record.output))
    power, both = float(nominal @ nominal), float(nominal @ taken)
    rest = _rest(
        taken, np.column_stack([each[record.okay] for each in (*parts, np.sign(parts[1]), np.ones(twist.size))])
    )
    return Inertia(both / power, Inertias.JOINT * float(rest @ rest) / float(taken @ taken)) if both != 0.0 else NOTHING


def _grid_or_none(record: Record, line: DrivelineModel) -> Grid | None:
    """Return how a line is simulated; None where its modes can't be with the recording: then it is one body."""
    try:
        return grid_for(line, [record])
    except BadModel:
        return None


def _lag_of(record: Record, line: DrivelineModel) -> float | None:
    """Return by how much the output is late against the nominal answer to the torque [s]; None where nothing tells."""
    grid = _grid_or_none(record, line)
    if grid is None or record.imposed is not None:
        return None
    signals = (np.diff(each) for each in (bridged(record), driven(record, line, grid)))
    Y, M = (np.fft.rfft(detrend(each) * np.hanning(each.size), 2 * each.size) for each in signals)
    first_hz = _first_hz(line)
    together = Y * M.conj()
    if first_hz > 0.0:  # where the mode rings, any whole period of it fits
        together[np.fft.rfftfreq(2 * record.okay.size - 2, record.sample_time_s) > Inertias.BELOW[1] * first_hz] = 0.0
    likeness = np.fft.irfft(together)
    most = min(round(Inertias.LONGEST_LAG_S / record.sample_time_s), likeness.size // Inertias.LAG_SHARE)
    lags = np.arange(-most, most + 1)
    best = int(lags[np.argmax(likeness[lags])])
    return best * record.sample_time_s if abs(best) < most else None


def bridged(record: Record) -> FloatArray:
    """Return the output with straight lines over samples that are missing; shape (N,) [unit of the output]."""
    good = np.flatnonzero(record.okay)
    return np.interp(np.arange(record.okay.size), good, record.output[good])


def by_band(
    record: Record, line: DrivelineModel, grid: Grid, low_hz: float, high_hz: float, least: float = 0.0
) -> Inertia:
    """Return the ratio of inertias by which the nominal answer to the torque is too large in a band.

    Nothing, where less than a share of the cross-spectrum has one sign.
    """
    model = driven(record, line, grid, 0.5 * low_hz, 2.0 * high_hz)
    output = bridged(record)
    frequency = np.fft.rfftfreq(model.size, record.sample_time_s)
    band = (frequency >= low_hz) & (frequency < high_hz)
    Y, M = (np.fft.rfft(detrend(signal) * np.hanning(signal.size))[band] for signal in (output, model))
    bins = max(Inertias.FEWEST_BINS, round(Inertias.BLOCK_HZ / frequency[1]))
    blocks = Y.size // bins
    if blocks == 0:
        return NOTHING
    Y, M = (spectrum[: blocks * bins].reshape(blocks, bins) for spectrum in (Y, M))
    cross, power = (Y * M.conj()).sum(axis=1), (np.abs(M) ** 2).sum(axis=1)
    total = float((np.abs(Y) ** 2).sum())
    if not (power > 0.0).all() or total == 0.0:
        return NOTHING
    ratio, one_way = float(power.sum() / np.abs(cross).sum()), float(cross.real.sum() / np.abs(cross).sum())
    share = float((np.abs(cross) ** 2 / power).sum()) / total
    return Inertia(math.copysign(ratio, one_way), 1.0 - share if abs(one_way) >= least else 1.0)


def as_one_body(record: Record, line: DrivelineModel, first_hz: float) -> Inertia:
    """Return the ratio of inertias by which the impulse of the torque changes the speed."""
    changes = _changes(record, first_hz)
    if changes is None:
        return NOTHING
    speed, impulse, usual = changes
    without = _rest(speed, usual)
    design = np.column_stack([impulse, usual])
    inverse = float(np.linalg.lstsq(design, speed, rcond=None)[0][0])
    rest = _rest(speed, design)
    if inverse == 0.0 or not without @ without > 0.0:
        return NOTHING
    return Inertia(1.0 / (inverse * _total(line)), float(rest @ rest) / float(without @ without))


def held_by_friction(record: Record, line: DrivelineModel) -> Inertia | None:
    """Return the nominal inertia where friction and gravity take what it leaves of the torque; None where they do not.

    Of a drive that is slow against its friction, the motion follows from the torque as little as the inertia shows.
    """
    changes = None if record.imposed is not None else _changes(record, _first_hz(line))
    if changes is None:
        return None
    speed, impulse, usual = changes
    rest, power = _rest(impulse - _total(line) * speed, usual), float(impulse @ impulse)
    share = float(rest @ rest) / power if power > 0.0 else 1.0
    return Inertia(1.0, share) if share <= Inertias.HELD else None


def _total(line: DrivelineModel) -> float:
    return sum(value for name, value in line.values().items() if name.startswith("J"))


def _first_hz(line: DrivelineModel) -> float:
    return float(natural_frequencies_rad_s(line.values())[0]) / (2.0 * math.pi)


def _changes(record: Record, first_hz: float) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return how speed, impulse and what is usual change over stretches that average the mode; None of too few."""
    period = 1.0 / (first_hz * record.sample_time_s) if first_hz > 0.0 else 0.0
    step = max(round(Inertias.STRETCH_S / record.sample_time_s), Inertias.FEWEST_STEPS)
    width = min(step, max(1, round(period)))
    # a short recording is cut into shorter stretches, as long as these average the mode
    step = min(
        step,
        max(
            (record.okay.size - 2 * width) // (Inertias.FEWEST_STRETCHES + 1),
            Inertias.FEWEST_STEPS,
            round(Inertias.FEWEST_PERIODS * period),
        ),
    )
    inside = slice(width, record.okay.size - width)
    okay = record.okay[inside]
    both = okay[step:] & okay[:-step]
    if both.sum() < Inertias.FEWEST_STRETCHES * step:
        return None
    signals = [uniform_filter1d(signal, width)[inside] for signal in _integrals(record)]
    changes = [(signal[step:] - signal[:-step])[both] for signal in signals]
    speed, impulse, *usual = (change - change.mean() for change in changes)
    return speed, impulse, np.column_stack(usual)


def _integrals(record: Record) -> list[FloatArray]:
    """Return the speed, and the integrals of the torque and of what is usual next to it: friction, and gravity.

    Friction is viscous and dry; gravity is that of a machine that goes to and fro, by the angle from where it began.
    """
    speed = measured_speed(record)
    good = np.flatnonzero(np.isfinite(speed))
    speed = np.interp(np.arange(speed.size), good, speed[good])
    angle = _integral(speed, record.sample_time_s)
    usual = [angle, _integral(np.sign(speed), record.sample_time_s)]
    if not turns_on([record]):
        usual += [_integral(wave(angle), record.sample_time_s) for wave in (np.sin, np.cos)]
    impulse = np.concatenate([[0.0], np.cumsum(record.total_torque_nm[:-1])]) * record.sample_time_s
    return [speed, impulse, *usual]


def _integral(signal: FloatArray, period_s: float) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(0.5 * (signal[1:] + signal[:-1]))]) * period_s


def _rest(y: FloatArray, design: FloatArray) -> FloatArray:
    return y - design @ np.linalg.lstsq(design, y, rcond=None)[0]


def tolerance_of(line: DrivelineModel) -> float:
    """Return the tolerance of the nominal inertia; of a line without one, the largest tolerance."""
    inertias = [each.tolerance for name, each in line.parameters.items() if name.startswith("J")]
    return max(inertias or [each.tolerance for each in line.parameters.values()])


def is_within_tolerance(found: Inertia, line: DrivelineModel) -> bool:
    """Tell whether an inertia is within reach of re-tuning; one that nothing tells is not."""
    return found.tells and 1.0 - tolerance_of(line) <= found.ratio <= 1.0 + tolerance_of(line)


def _less_friction(records: Sequence[Record], found: Sequence[Inertia], line: DrivelineModel) -> list[Inertia]:
    """Return what recordings fit, those that tell nothing as what friction explains: it is no fault of theirs."""
    return [
        each if each.tells else held_by_friction(record, line) or each
        for record, each in zip(records, found, strict=True)
    ]


def _is_suspicious(found: Sequence[Inertia], line: DrivelineModel) -> bool:
    """Tell whether an inertia is off, differs between the bands, or from one recording to the other."""
    counted = [math.log(abs(each.ratio)) for each in found if each.tells]
    return (
        any(not each.tells or not is_within_tolerance(each, line) for each in found)
        or any(abs(each.log_ratio) > Mistakes.BANDS_BEYOND for each in found)
        or (bool(counted) and max(counted) - min(counted) > Mistakes.LEAST_LOG_RATIO)
    )


def is_plausible(found: Inertia, line: DrivelineModel) -> bool:
    """Tell whether an inertia is within reach of re-tuning, or of physics missing."""
    tolerance = tolerance_of(line)
    return (1.0 - tolerance) / Mistakes.BEYOND <= found.ratio <= (1.0 + tolerance) * Mistakes.BEYOND


@dataclass(frozen=True, slots=True)
class Measured:
    """What recordings show that do not fit their line; without a line, what they show by themselves."""

    records: tuple[Record, ...]  # those long enough to tell
    found: tuple[Inertia, ...]  # what each of them fits
    ratio: float = 1.0  # the middle one of those beyond their tolerance; 1 where none is
    off: int = 0  # which recording that is of
    lags_s: tuple[float, ...] = ()  # by how much outputs are late against the torque, each once
    is_off: bool = False  # whether one is beyond what re-tuning, or missing physics, would make of it
    is_right: bool = False  # whether one is within its tolerance


def measured(records: Sequence[Record], line: DrivelineModel | None) -> Measured | None:
    """Return what recordings show that do not fit a line; None where they fit, and where none of them tells."""
    fits = [(record, fitted_inertia(record, line or BODY)) for record in records]
    # one that is too short for its line says nothing: a period that makes it longer would explain more of nothing
    long = [(record, each) for record, each in fits if line is None or not math.isnan(each.ratio)]
    kept, found = tuple(record for record, _ in long), tuple(each for _, each in long)
    if line is None or not long:
        return Measured(kept, found) if long else None
    if not _is_suspicious(_less_friction(kept, found, line), line):
        return None
    off = sorted((f.ratio, i) for i, f in enumerate(found) if f.tells and not is_within_tolerance(f, line))
    ratio, at = off[len(off) // 2] if off else (1.0, 0)
    return Measured(
        kept,
        found,
        ratio,
        at,
        tuple(sorted({lag for record in kept if (lag := _lag_of(record, line)) is not None})),
        is_off=any(each.tells and not is_plausible(each, line) for each in found),
        is_right=any(is_within_tolerance(each, line) for each in found),
    )
