"""All that the raw recordings tell of their acquisition, before any model."""

from __future__ import annotations

from collections.abc import Sequence

from estimator.diagnosis.acquisition.compensate import blanked, compensate
from estimator.diagnosis.acquisition.finding import Finding
from estimator.diagnosis.acquisition.lost import lost_samples
from estimator.diagnosis.acquisition.quantised import speed_quantisation
from estimator.diagnosis.acquisition.stale import stale_samples
from estimator.diagnosis.acquisition.stamped_jitter import stamped_jitter
from estimator.signals.record import Record

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
