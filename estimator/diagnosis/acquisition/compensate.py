"""Records without the acquisition's faults: what is stale or lost is masked, what is known of it is filled in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.acquisition.finding import OUTPUT, Finding, no_cells
from estimator.diagnosis.acquisition.stale import fill
from estimator.diagnosis.acquisition.stamped_jitter import stamp_offsets_s
from estimator.signals.record import Record, uniform_period_s

UNREAD = frozenset({"stale_samples", "lost_samples"})
"""Findings whose readings are not what was measured in that row."""


def compensate(records: Sequence[Record], findings: Sequence[Finding]) -> tuple[Record, ...]:
    """Return the records as they would be without what was found.

    Outputs that are stale or lost are masked. Torques that are stale or lost are filled in, by their reference or
    their clock where they have one, and ``torque_okay`` is False where that leaves them unknown. Stamped jitter becomes
    ``offset_s``, and the time uniform. Quantisation can't be undone. Records nothing was found in are returned
    as they are.
    """
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
