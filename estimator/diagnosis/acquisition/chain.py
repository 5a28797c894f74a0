"""The acquisition chain of a set of recordings: as they were read, and with its faults compensated."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from estimator.diagnosis.acquisition.finding import OUTPUT, AcquisitionFinding, no_cells, runs
from estimator.diagnosis.acquisition.jitter import hidden_jitter, mean_shift, stamp_offsets_s, stamped_jitter
from estimator.diagnosis.acquisition.quantised import lost_samples, speed_quantisation
from estimator.diagnosis.acquisition.stale import flagged, repeated, stale_samples
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.segments import tiles
from estimator.diagnosis.thresholds import Quantised, Stale
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, rates
from estimator.physics.free_run import NOTHING_KNOWN, FreeRun, Own, free_run
from estimator.physics.model import DrivelineModel
from estimator.signals.record import BoolArray, FloatArray, Record, separated_outputs, uniform_period_s

UNREAD = frozenset({"stale_samples", "lost_samples"})
"""Findings whose readings are not what was measured in that row."""

AMONG_READ = (stale_samples, speed_quantisation, stamped_jitter)
"""What is looked for among the readings that were not lost."""


def compensate(records: Sequence[Record], findings: Sequence[AcquisitionFinding]) -> tuple[Record, ...]:
    """Return the records as they would be without what was found."""
    return tuple(_compensated(record, findings) for record in records)


def _compensated(record: Record, findings: Sequence[AcquisitionFinding]) -> Record:
    unread = no_cells(record)
    for finding in findings:
        if finding.name in UNREAD:
            unread |= finding.touched(record)
    if unread.any():
        record = _without(record, unread)
    if any(finding.name == "sample_jitter" and finding.rows(record).any() for finding in findings):
        record = _on_time(record)
    return record


def blanked(record: Record, finding: AcquisitionFinding | None) -> Record:
    """Return a record in which the readings a finding touches were not read, for what is looked for next."""
    if finding is None:
        return record
    cells = finding.touched(record)
    blank = _without(record, cells)
    output = np.where(cells[:, OUTPUT], np.nan, record.output)
    return replace(blank, output=output, torque_okay=record.torque_trusted & ~cells[:, 1:])


def _without(record: Record, unread: np.ndarray[tuple[int, int], np.dtype[np.bool_]]) -> Record:
    trusted = record.torque_trusted & ~unread[:, 1:]
    filled = [fill(record.torque_nm[:, i], trusted[:, i], record.reference_nm) for i in range(trusted.shape[1])]
    known = np.column_stack([known for _, known in filled])
    return replace(
        record,
        torque_nm=np.column_stack([torque for torque, _ in filled]),
        okay=record.okay & ~unread[:, OUTPUT],
        torque_okay=None if known.all() else known,
    )


def followed(torque: FloatArray, trusted: BoolArray, reference: FloatArray) -> tuple[FloatArray, BoolArray, bool]:
    """Return a torque as its reference implies it, the rows in which it does, and whether that is as good as a reading.

    ``torque`` and ``reference`` [Nm] and ``trusted`` have shape (N,). Where the reference does not explain the torque's
    changes the torque is returned as it is, with no row.
    """
    regressors = _regressors(np.where(~trusted & (reference == 0.0), np.nan, reference))  # lost with the torque
    predicted = np.all(np.isfinite(regressors), axis=1)
    read = predicted & trusted
    both = read[1:] & read[:-1]
    if read.sum() < Stale.FEWEST_ROWS or not both.any():
        return torque, np.zeros_like(trusted), False
    gain = np.linalg.lstsq(regressors[read], torque[read])[0]
    by_reference = regressors @ gain
    rows = np.flatnonzero(read)
    by_reference += np.interp(np.arange(torque.size), rows, (torque - by_reference)[rows])
    left, change = np.diff(torque - regressors @ gain)[both], np.diff(torque)[both]
    power_left, power = float(left @ left), float(change @ change)
    if power_left > Stale.MOST_LEFT * power:
        return torque, np.zeros_like(trusted), False
    return by_reference, predicted, power_left <= Stale.AS_GOOD * power


def _regressors(reference: FloatArray) -> FloatArray:
    before = [
        np.concatenate([np.full(lag, reference[0]), reference[: reference.size - lag]]) for lag in range(Stale.PERIODS)
    ]
    return np.column_stack([*before, np.ones(reference.size)])


@dataclass(frozen=True, slots=True)
class Clock:
    """When and by how much a torque steps: in rows ``k % period == phase`` [samples], by ``+-step_nm``."""

    period: int  # from tick to tick [samples]
    phase: int  # row of the first tick, below ``period``
    step_nm: float  # median size of a step at a tick [Nm]
    usual_nm: float  # typical change from row to row within a hold [Nm]

    def ticks(self, first: int, last: int) -> list[int]:
        """Return the ticks from one row to another, both included."""
        return [row for row in range(first, last + 1) if row % self.period == self.phase]

    def explains(self, change_nm: float) -> bool:
        """Return whether a change [Nm] is one step of the clock, or so small that there was none."""
        size = abs(change_nm)
        return size <= Stale.CLEAR_STEP * self.usual_nm or abs(size - self.step_nm) <= Stale.SAME_STEP * self.step_nm


def clock_of(torque: FloatArray, trusted: BoolArray) -> Clock | None:
    """Return the clock at whose ticks a torque steps; None where there is none of two samples or more."""
    change = np.abs(np.diff(torque))
    known = trusted[1:] & trusted[:-1]
    if known.sum() < Stale.FEWEST_STEPS:
        return None
    usual = 1.4826 * float(np.median(change[known]))
    steps = 1 + np.flatnonzero(known & (change > Stale.CLEAR_STEP * usual))
    if steps.size < Stale.FEWEST_STEPS:
        return None
    for period in range(Stale.LONGEST_HOLD, 1, -1):
        on_tick = np.bincount(steps % period, minlength=period)
        if on_tick.max() >= Stale.ON_TICK * steps.size:
            return Clock(period, int(on_tick.argmax()), float(np.median(change[steps - 1])), usual)
    return None


def fill(torque: FloatArray, trusted: BoolArray, reference: FloatArray | None = None) -> tuple[FloatArray, BoolArray]:
    """Fill the rows of a torque [Nm] that are not trusted; return it and the rows that now are known, shape (N,)."""
    filled, known = _by_clock(torque, trusted)
    if reference is None or trusted.all():
        return filled, known
    by_reference, predicted, as_good = followed(torque, trusted, reference)
    unread = predicted & ~trusted & (as_good | ~known)
    filled[unread] = by_reference[unread]
    return filled, known | (unread & as_good)


def _by_clock(torque: FloatArray, trusted: BoolArray) -> tuple[FloatArray, BoolArray]:
    clock = clock_of(torque, trusted)
    filled, known = torque.copy(), trusted.copy()
    for begin, end in runs(~trusted):
        before, after = torque[max(begin - 1, 0)], torque[min(end, torque.size - 1)]
        if begin == 0 or end == torque.size:
            filled[begin:end] = after if end < torque.size else before
            continue
        filled[begin:end] = np.linspace(before, after, end - begin + 2)[1:-1]
        if clock is not None and clock.explains(after - before) and len(ticks := clock.ticks(begin, end)) < 2:
            change = ticks[0] if ticks else end
            filled[begin:change], filled[change:end] = before, after
            known[begin:end] = True
    return filled, known


def _on_time(record: Record) -> Record:
    offset_s = stamp_offsets_s(record)
    period_s = uniform_period_s(record.time_s)
    return replace(record, sample_time_s=period_s, time_s=record.time_s - offset_s, offset_s=offset_s)


def as_read(
    output: FloatArray, record: Record, effects: Mapping[str, Mapping[str, float]], noise: float = 0.0
) -> FloatArray:
    """Return a simulated output as this recording would show it, in the mean of a noise before it is rounded."""
    read = output
    if "speed_quantisation" in effects:
        read = _rounded(read, effects["speed_quantisation"]["step_rad_s"], noise)
    if "stale_samples" in effects:
        read = _repeating(read, record)
    return read


def _rounded(output: FloatArray, step: float, noise: float) -> FloatArray:
    """Return the expected reading in steps of an output with white noise, shape (N,), all in the output's unit.

    With much noise it is the output itself, without any the nearest step (Widrow and Kollár, Quantization Noise, 2008).
    """
    nearest = np.round(output / step)
    if noise < Quantised.SHARP * step:
        return nearest * step
    below = (nearest - output / step)[:, None] + np.arange(-Quantised.REACH, Quantised.REACH + 1) - 0.5
    reached = ndtr(below * (step / noise))  # probability to be below each step's lower end
    return step * (nearest + np.sum(np.diff(reached, axis=1) * np.arange(-Quantised.REACH, Quantised.REACH), axis=1))


def _repeating(output: FloatArray, record: Record) -> FloatArray:
    (stale,) = repeated([np.where(flagged(record), np.nan, record.output)]).rows
    renewed = np.maximum.accumulate(np.where(stale, 0, np.arange(output.size)))
    return output[renewed]


def recognise(records: Sequence[Record]) -> tuple[AcquisitionFinding, ...]:
    """Return what is recognised in a set of recordings of one acquisition chain; none in healthy ones."""
    lost = lost_samples(records)
    read = [blanked(record, lost) for record in records]
    found = (lost, *(look(read) for look in AMONG_READ))
    return tuple(finding for finding in found if finding is not None)


def without_lost_samples(records: Sequence[Record]) -> tuple[Record, ...]:
    """Return records without the readings that were lost: zeros without a flag are neither noise nor motion."""
    lost = lost_samples(records)
    return tuple(records) if lost is None else compensate(records, [lost])


@dataclass(frozen=True, slots=True)
class Chain:
    """Recordings and what is recognised of the chain that made them."""

    raw: tuple[Record, ...]  # as read
    records: tuple[Record, ...]  # with the faults compensated, and without what jitter adds in the mean, for fits
    findings: tuple[AcquisitionFinding, ...]  # what was recognised
    shifts: tuple[FloatArray, ...] = ()  # (N,)

    @property
    def separated(self) -> list[Record]:
        """The recordings for fits, each measured output by itself."""
        return separated_outputs(self.records, noise_floor)

    def with_jitter_in(self, result: FitResult) -> Chain:
        """Return the chain with the jitter that only the errors of a converged fit show, where they show any.

        What cannot be known is by how much each reading is off. What they are off in the mean is taken off them.
        """
        if any(finding.name == "sample_jitter" for finding in self.findings):
            return self
        errors = [record.output - output for output, record in zip(result.outputs, self.records, strict=True)]
        slopes = rates(result)
        found = hidden_jitter(self.records, errors, slopes, [record.okay for record in self.records])
        if found is None:
            return self
        jitter_s = found.parameters["jitter_s"].value
        shifts = tuple(mean_shift(steep, jitter_s) for steep in slopes)
        steady = tuple(replace(r, output=r.output - shift) for r, shift in zip(self.records, shifts, strict=True))
        return replace(self, records=steady, findings=(*self.findings, found), shifts=shifts)

    def only(self, names: Collection[str]) -> Chain:
        """Return the chain with these of its findings alone, its recordings for fits as they are."""
        findings = tuple(finding for finding in self.findings if finding.name in names)
        return replace(self, findings=findings, shifts=self.shifts if "sample_jitter" in names else ())

    def effects(self) -> dict[str, dict[str, float]]:
        """Values of the parameters of the faults found, by effect and parameter."""
        return {f.name: {name: sized.value for name, sized in f.parameters.items()} for f in self.findings}

    def added_squares(self, result: FitResult) -> list[float]:
        """Return the sum of squared errors that each finding adds to the good readings [square of the output's unit].

        It is of what the fault does to the readings that ``result`` simulates. By how much the error falls once a fault
        is known is no measure of it: rounding, and jitter that is not stamped, are known and not undone.
        """
        slopes = rates(result)
        return [
            sum(_added(each, *of) for of in zip(result.outputs, slopes, self.raw, strict=True))
            for each in self.findings
        ]

    def read(self, outputs: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
        """Return simulated outputs as this chain would have read them, each (N,)."""
        effects, noise = self.effects(), 0.0
        if "speed_quantisation" in effects:
            rounding = effects["speed_quantisation"]["step_rad_s"] ** 2 / 12.0
            noise = math.sqrt(max(noise_floor(self.records) ** 2 - rounding, 0.0))
        read = tuple(as_read(output, record, effects, noise) for output, record in zip(outputs, self.raw, strict=True))
        return tuple(each + shift for each, shift in zip(read, self.shifts, strict=True)) if self.shifts else read

    def errors(self, outputs: Sequence[FloatArray], within: Sequence[BoolArray] | None = None) -> list[FloatArray]:
        """Return simulated, as this chain would have read it, less recorded; the good rows of each raw recording."""
        rows = [_read_rows(record, self.findings) for record in self.raw]
        if within is not None:
            rows = [read & inside for read, inside in zip(rows, within, strict=True)]
        read = zip(self.read(outputs), self.raw, rows, strict=True)
        return [(each - record.output)[good] for each, record, good in read]


def _added(finding: AcquisitionFinding, output: FloatArray, slope: FloatArray, record: Record) -> float:
    """Return the squares that a fault adds to an output, shape (N,), whose slopes of both sides have shape (2, N)."""
    sizes = {name: sized.value for name, sized in finding.parameters.items()}
    if finding.name == "speed_quantisation":  # rounding is uniform over a step
        return float(record.okay.sum()) * sizes["step_rad_s"] ** 2 / 12.0
    if finding.name == "sample_jitter":
        return float(np.sum(np.mean((sizes["jitter_s"] * slope[:, record.okay]) ** 2, axis=0)))  # of both sides
    if finding.name == "stale_samples":
        return float(np.sum((_repeating(output, record) - output)[record.okay] ** 2))
    rows = record.okay & finding.touched(record)[:, OUTPUT]
    return float(np.sum((output - record.output)[rows] ** 2))


def with_faults_compensated(records: Sequence[Record]) -> Chain:
    """Recognise the faults of a set of recordings and compensate them."""
    findings = recognise(records) if records else ()
    return Chain(tuple(records), compensate(records, findings), findings)


def _read_rows(record: Record, findings: Iterable[AcquisitionFinding]) -> BoolArray:
    rows = record.okay
    for finding in findings:
        if finding.name == "lost_samples":
            rows = rows & ~finding.touched(record)[:, OUTPUT]
    return rows


def without_acquisition_effects(model: DrivelineModel) -> DrivelineModel:
    """Return a model without the effects that are recognised before a fit: these are corrected in the recordings."""
    return replace(model, effects={name: v for name, v in model.effects.items() if not EFFECTS[name].recognised})


def replay(model: DrivelineModel, record: Record, known: Own = NOTHING_KNOWN) -> FreeRun:
    """Simulate one recording with a model, as the acquisition that the model describes would have read it."""
    parts = tiles(record)
    runs = [_replay(model, part, known) for part in parts]
    most = max(range(len(parts)), key=lambda i: int(parts[i].okay.sum()))
    output = np.concatenate([run.output for run, _ in runs])
    read = np.concatenate([rows for _, rows in runs])
    error = (output - record.output)[read]
    further = tuple(np.concatenate(each) for each in zip(*(run.further for run, _ in runs), strict=True))
    beyond = tuple(dict.fromkeys(sentence for run, _ in runs for sentence in run.beyond))
    return FreeRun(output, float(np.sqrt(np.mean(error**2))), runs[most][0].start, further, beyond)


def _replay(model: DrivelineModel, record: Record, known: Own) -> tuple[FreeRun, BoolArray]:
    """Simulate one recording without long gaps; also returns the rows that were read, shape (N,)."""
    acquired: Mapping[str, Mapping[str, float]] = {
        name: {key: value.value for key, value in values.items()}
        for name, values in model.effects.items()
        if EFFECTS[name].recognised
    }
    if not acquired:
        return free_run(model, record, known), record.okay
    found = tuple(finding for finding in recognise([record]) if finding.name in acquired)
    run = free_run(without_acquisition_effects(model), compensate([record], found)[0], known)
    return replace(run, output=as_read(run.output, record, acquired)), _read_rows(record, found)
