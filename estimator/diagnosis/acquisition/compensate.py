"""Recognition of faults of the acquisition, their compensation, and readings as a faulty chain gives them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.acquisition.finding import OUTPUT, Finding, flagged, no_cells
from estimator.diagnosis.acquisition.jitter import stamp_offsets_s, stamped_jitter
from estimator.diagnosis.acquisition.lost import lost_samples
from estimator.diagnosis.acquisition.quantised import speed_quantisation
from estimator.diagnosis.acquisition.stale import fill, repeated, stale_samples
from estimator.signals.record import FloatArray, Record, uniform_period_s

UNREAD = frozenset({"stale_samples", "lost_samples"})
"""Findings whose readings are not what was measured in that row."""


def compensate(records: Sequence[Record], findings: Sequence[Finding]) -> tuple[Record, ...]:
    """Return the records as they would be without what was found."""
    return tuple(_compensated(record, findings) for record in records)


def _compensated(record: Record, findings: Sequence[Finding]) -> Record:
    unread = no_cells(record)
    for finding in findings:
        if finding.name in UNREAD:
            unread |= finding.touched(record)
    if unread.any():
        record = _without(record, unread)
    if any(finding.name == "sample_jitter" and finding.rows(record).any() for finding in findings):
        record = _on_time(record)
    return record


def blanked(record: Record, finding: Finding | None) -> Record:
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


def _on_time(record: Record) -> Record:
    offset_s = stamp_offsets_s(record)
    period_s = uniform_period_s(record.time_s)
    return replace(record, sample_time_s=period_s, time_s=record.time_s - offset_s, offset_s=offset_s)


def as_read(output: FloatArray, record: Record, effects: Mapping[str, Mapping[str, float]]) -> FloatArray:
    """Return a simulated output as this recording would show it.

    Lost samples and jitter leave it as it is: what was lost is not shown, and an instant that nothing tells can't be
    reproduced (one that stamps tell is in ``record.offset_s``).
    """
    read = output
    if "speed_quantisation" in effects:
        step = effects["speed_quantisation"]["step_rad_s"]
        read = np.round(read / step) * step
    if "stale_samples" in effects:
        read = _repeating(read, record)
    return read


def _repeating(output: FloatArray, record: Record) -> FloatArray:
    (stale,) = repeated([np.where(flagged(record), np.nan, record.output)]).rows
    renewed = np.maximum.accumulate(np.where(stale, 0, np.arange(output.size)))
    shown: FloatArray = output[renewed]
    return shown


AMONG_READ = (stale_samples, speed_quantisation, stamped_jitter)
"""What is looked for among the readings that were not lost."""


def recognise(records: Sequence[Record]) -> tuple[Finding, ...]:
    """Return what is recognised in a set of recordings of one acquisition chain; none in healthy ones."""
    lost = lost_samples(records)
    read = [blanked(record, lost) for record in records]
    found = (lost, *(look(read) for look in AMONG_READ))
    return tuple(finding for finding in found if finding is not None)


def as_if_not_lost(records: Sequence[Record]) -> tuple[Record, ...]:
    """Return records without the readings that were lost: zeros without a flag are neither noise nor motion."""
    lost = lost_samples(records)
    return tuple(records) if lost is None else compensate(records, [lost])
