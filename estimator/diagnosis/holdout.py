"""Hold-out: how well a hypothesis does on samples that its fit has not seen.

Short blocks are kept out all along; what is on both sides must predict them, for a constant law as for a profile or an
event. Without recordings of their own for it, a second fit leaves the blocks out of the recordings. In recordings kept
out for it the parameters stay as they were fitted, and what is a recording's own (load torque, initial state, profile,
moments) is estimated on the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from estimator.diagnosis.hypotheses import Effects
from estimator.physics.fit import FitResult, fit
from estimator.physics.free_run import simulate_foreign
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import concurrently
from estimator.signals.record import BoolArray, FloatArray, Record

BLOCK_S, EVERY_S = 0.6, 2.0
"""Blocks kept out for a profile: shorter than its knot spacing, so that its neighbours predict it."""

FEWEST_BLOCKS = 3
"""Blocks of a recording at least: it may be shorter than one of these."""


@dataclass(frozen=True, slots=True)
class HoldOut:
    """RMS of the free-run error on unseen samples, without and with a set of effects.

    Attributes
    ----------
    spread : float
        Standard error of the fall of the squared error, as a share of that before: blocks differ.
    """

    before: float
    after: float
    spread: float = 0.0


def blocks(record: Record) -> BoolArray:
    """Return which samples are kept out: blocks all along, none at the very ends; shape (N,).

    A recording too short for as many has shorter ones, closer together.
    """
    since_s = record.time_s - record.time_s[0]
    scale = min(1.0, float(since_s[-1]) / (FEWEST_BLOCKS * EVERY_S))
    every_s, block_s = scale * EVERY_S, scale * BLOCK_S
    phase = np.mod(since_s, every_s)
    middle = 0.5 * (every_s - block_s)
    inside: BoolArray = (phase >= middle) & (phase < middle + block_s)
    return inside


@dataclass
class Examiner:
    """Judges sets of effects on samples kept out of their fits; each fit is made once, from where the full one ended.

    Attributes
    ----------
    holdout : sequence of Record
        Recordings kept out; empty to judge in the blocks of ``records``.
    """

    model: DrivelineModel
    records: Sequence[Record]
    holdout: Sequence[Record]
    _between: dict[tuple[Effects, bytes], tuple[FloatArray, ...]] = field(default_factory=dict)

    def compare(self, before: FitResult, smaller: Effects, after: FitResult, larger: Effects) -> HoldOut:
        """Compare two hypotheses on unseen samples; ``before`` and ``after`` are their fits of everything."""
        squares = concurrently(lambda each: self._squares(*each), [(before, smaller), (after, larger)])
        counts = np.array([np.sum(block) for record in self._judged for block in _single_blocks(record)])
        fall = squares[0] - squares[1]
        spread = float(np.std(fall) * np.sqrt(fall.size) / squares[0].sum())
        rms_before, rms_after = (float(np.sqrt(each.sum() / counts.sum())) for each in squares)
        return HoldOut(rms_before, rms_after, spread)

    @property
    def _judged(self) -> Sequence[Record]:
        return self.holdout or self.records

    def _squares(self, full: FitResult, effects: Effects) -> FloatArray:
        """Return the sum of squared errors in each block."""
        if self.holdout:
            use = [record.okay & ~blocks(record) for record in self.holdout]
            outputs = foreign_outputs(full, self.model, self.holdout, use, effects)
        else:
            outputs = self._from_between(full, effects)
        return np.array(
            [
                np.sum((output - record.output)[block] ** 2)
                for output, record in zip(outputs, self._judged, strict=True)
                for block in _single_blocks(record)
            ]
        )

    def _from_between(self, full: FitResult, effects: Effects) -> tuple[FloatArray, ...]:
        """Return the outputs of a fit of what is between the blocks alone, begun where the full one ended."""
        end = (effects, full.x.tobytes())
        if end not in self._between:
            use = tuple(record.okay & ~blocks(record) for record in self.records)
            self._between[end] = fit(replace(full.problem, use=use), full.x).outputs
        return self._between[end]


def _single_blocks(record: Record) -> list[BoolArray]:
    """Return the good samples of each block that has any."""
    out = blocks(record) & record.okay
    number = np.floor((record.time_s - record.time_s[0]) / EVERY_S).astype(int)
    return [out & (number == i) for i in np.unique(number[out])]


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
