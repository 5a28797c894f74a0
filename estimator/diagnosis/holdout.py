"""Hold-out: how well a hypothesis does on samples that its fit has not seen.

Parameters are fitted on one part of the data; on the other only what is every recording's own is estimated (load
torque, initial state, a profile where the hypothesis has one), as the contract has it for any recording. The other part
is the recordings kept out for it or, without any, the last part of each recording taken as a recording of its own.

A profile over time, or an event, can't be carried to another time. A hypothesis that has one is judged on short blocks
kept out all along, which what is on both sides must predict.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.hypotheses import Bench, Effects
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult
from estimator.physics.free_run import simulate_foreign
from estimator.physics.model import DrivelineModel
from estimator.signals.record import BoolArray, FloatArray, Record

KEPT_OUT = 0.3
"""Share of each recording that the fit does not see."""

BLOCK_S, EVERY_S = 0.6, 2.0
"""Blocks kept out for a profile: shorter than its knot spacing, so that its neighbours predict it."""


SHOWS = 1.05
"""Ratio of errors above which unseen stretches show a difference between two hypotheses."""


@dataclass(frozen=True, slots=True)
class HoldOut:
    """RMS of the free-run error on unseen samples, without and with a set of effects."""

    before: float
    after: float


def split(record: Record) -> tuple[Record, Record]:
    """Cut a recording in two by its good samples: what the fit sees, and its last part, a recording of its own."""
    good = np.flatnonzero(record.okay)
    cut = int(good[round((1.0 - KEPT_OUT) * good.size)])
    return _part(record, slice(None, cut)), _part(record, slice(cut, None))


def _part(record: Record, rows: slice) -> Record:
    return replace(
        record,
        time_s=record.time_s[rows],
        torque_nm=record.torque_nm[rows],
        output=record.output[rows],
        okay=record.okay[rows],
        began_s=float(record.time_s[0]) if record.began_s is None else record.began_s,
        torque_okay=None if record.torque_okay is None else record.torque_okay[rows],
        offset_s=None if record.offset_s is None else record.offset_s[rows],
        imposed=None if record.imposed is None else record.imposed[rows],
    )


def blocks(record: Record) -> BoolArray:
    """Return which samples are kept out: blocks all along, none at the very ends; shape (N,)."""
    phase = np.mod(record.time_s - record.time_s[0], EVERY_S)
    middle = 0.5 * (EVERY_S - BLOCK_S)
    inside: BoolArray = (phase >= middle) & (phase < middle + BLOCK_S)
    return inside


@dataclass
class Examiner:
    """Judges sets of effects on samples kept out of their fits; each fit is made once.

    Attributes
    ----------
    holdout : sequence of Record
        Recordings kept out; empty to keep stretches of ``records`` out.
    """

    model: DrivelineModel
    records: Sequence[Record]
    holdout: Sequence[Record]

    def __post_init__(self) -> None:
        parts = [split(record) for record in self.records]
        self._unseen = list(self.holdout) or [last for _, last in parts]
        self._seen = None if self.holdout else Bench(self.model, *_all_of([first for first, _ in parts]))
        self._between = Bench(self.model, self.records, [r.okay & ~blocks(r) for r in self.records])

    def compare(self, before: FitResult, smaller: Effects, after: FitResult, larger: Effects) -> HoldOut:
        """Compare two hypotheses on unseen samples; ``before`` and ``after`` are their fits of everything.

        Where a stretch with its own load torque and initial state shows no difference, blocks all along judge.
        """
        return HoldOut(self._error_in_blocks(before, smaller), self._error_in_blocks(after, larger))

    def _error_on_unseen(self, full: FitResult, effects: Effects) -> float:
        fitted = full if self._seen is None else self._seen.fit(effects, full)
        use = [record.okay for record in self._unseen]
        return _rms(self._unseen, foreign_outputs(fitted, self.model, self._unseen, use, effects), use)

    def _error_in_blocks(self, full: FitResult, effects: Effects) -> float:
        if not self.holdout:
            kept_out = [blocks(record) & record.okay for record in self.records]
            return _rms(self.records, self._between.fit(effects, full).outputs, kept_out)
        kept_out = [blocks(record) & record.okay for record in self.holdout]
        use = [record.okay & ~out for record, out in zip(self.holdout, kept_out, strict=True)]
        outputs = foreign_outputs(full, self.model, self.holdout, use, effects)
        return _rms(self.holdout, outputs, kept_out)


def _belongs_to_time(effects: Effects) -> bool:
    return any(EFFECTS[name].profile or EFFECTS[name].event for name in effects)


def _all_of(records: Sequence[Record]) -> tuple[Sequence[Record], Sequence[BoolArray]]:
    return records, [record.okay for record in records]


def foreign_outputs(
    result: FitResult,
    model: DrivelineModel,
    records: Sequence[Record],
    use: Sequence[BoolArray],
    effects: Effects,
) -> tuple[FloatArray, ...]:
    """Simulate other recordings with a fit's parameters; only what is each recording's own is estimated."""
    return tuple(
        simulate_foreign(model, result.p, result.problem.grid, record, samples, effects)
        for record, samples in zip(records, use, strict=True)
    )


def _rms(records: Sequence[Record], outputs: Sequence[FloatArray], where: Sequence[BoolArray]) -> float:
    errors = [(out - record.output)[mask] for record, out, mask in zip(records, outputs, where, strict=True)]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
