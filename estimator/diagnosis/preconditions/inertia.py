"""Inertia seen by torque and motion, against the model's."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import detrend

from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.preconditions.channels import standstill
from estimator.diagnosis.thresholds import Inertias, Recordings
from estimator.errors import BadModel, NotExciting
from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import Grid, flat, grid_for
from estimator.physics.model import DrivelineModel, Parameter, Structure, natural_frequencies_rad_s
from estimator.physics.motion import measured_speed, turns_on
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, Record

UNREAD = ", and that every torque is read: what another one does counts as noise."

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


def lag_of(record: Record, line: DrivelineModel) -> float | None:
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
    most = min(round(Inertias.LONGEST_LAG_S / record.sample_time_s), likeness.size // 4)
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


def tolerance_of(line: DrivelineModel) -> float:
    """Return the tolerance of the nominal inertia; of a line without one, the largest tolerance."""
    inertias = [each.tolerance for name, each in line.parameters.items() if name.startswith("J")]
    return max(inertias or [each.tolerance for each in line.parameters.values()])


def is_within_tolerance(found: Inertia, line: DrivelineModel) -> bool:
    """Tell whether an inertia is within reach of re-tuning; one that nothing tells is not."""
    return found.tells and 1.0 - tolerance_of(line) <= found.ratio <= 1.0 + tolerance_of(line)


def ratio_off(found: Sequence[Inertia], line: DrivelineModel | None) -> tuple[float, int]:
    """Return the middle one of the inertias' ratios beyond their tolerance, and of which recording; 1 of the first."""
    off = [
        (each.ratio, i)
        for i, each in enumerate(found)
        if each.tells and line is not None and not is_within_tolerance(each, line)
    ]
    return sorted(off)[len(off) // 2] if off else (1.0, 0)
