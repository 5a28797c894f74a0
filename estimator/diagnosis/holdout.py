"""Hold-out: how well a hypothesis does on samples that its fit has not seen.

Short blocks are kept out all along; what is on both sides must predict them, for a constant law as for a profile or an
event. Without recordings of their own for it, a second fit leaves the blocks out of the recordings. In recordings kept
out for it the parameters stay as they were fitted, and what is a recording's own (load torque, initial state, profile,
moments) is estimated on the rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.diagnosis.hypotheses import Effects
from estimator.physics.fit import FitResult
from estimator.physics.free_run import simulate_foreign
from estimator.physics.model import DrivelineModel
from estimator.signals.record import BoolArray, FloatArray, Record

BLOCK_S, EVERY_S = 0.6, 2.0
"""Blocks kept out for a profile: shorter than its knot spacing, so that its neighbours predict it."""

FEWEST_BLOCKS = 3
"""Blocks of a recording at least: it may be shorter than one of these."""


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
