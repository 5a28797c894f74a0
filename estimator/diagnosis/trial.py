"""One effect tried on top of others: what speaks for it, when its events are, and how rivals rank."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from estimator.diagnosis.evidence import VERY_STRONG, Gain, information
from estimator.diagnosis.holdout import HoldOut
from estimator.diagnosis.hypotheses import Effects
from estimator.diagnosis.intervals import Z95, covariance, interval
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult
from estimator.physics.own_scan import MOST_CELLS
from estimator.physics.steps import inside, moments_of
from estimator.signals.record import FloatArray

PART_SEEN = 0.1
"""Share of the time in which an event acts that must be in recordings where it begins or ends. A brake all through one
recording is dry friction, which others that do not reverse hide; half a second of it in one of them is chance."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One effect tried on top of others, with what speaks for it and the first test it failed."""

    name: str
    effects: Effects
    result: FitResult
    gain: Gain
    holdout: HoldOut | None
    p_value: float
    failed: str | None

    @property
    def values(self) -> dict[str, float]:
        """Fitted values of the parameters that all recordings share."""
        return self.result.values_of(self.name)


def pressed_parameters(result: FitResult) -> frozenset[str]:
    """Return the nominal parameters that a fit has moved to a bound of what they are trusted to."""
    return frozenset(
        shared.name
        for shared, pinned in zip(result.problem.shared, result.pinned, strict=False)
        if pinned and not shared.effect and shared.low < shared.high
    )


def ranks(passing: Sequence[Trial], before: FitResult) -> dict[str, float]:
    """Return what trials gain over one fit, with one number of independent samples, that of the least error.

    Of equivalent effects that gain the same, the first along the chain counts more.
    """
    if not passing:
        return {}
    n = min(passing, key=lambda trial: trial.result.squares).gain.n_effective
    gained = {t.name: information(before, t.result, n) - 2.0 * scan_choices(t.name, t.result) for t in passing}
    found = {}
    for name, mine in gained.items():
        most = max(gained.get(twin, mine) for twin in (name, *EFFECTS[name].equivalent))
        place = list(EFFECTS).index(name) / len(EFFECTS)
        found[name] = most - place if most - mine < VERY_STRONG else mine
    return found


def scan_choices(name: str, result: FitResult) -> float:
    """Return the logarithm of how many intervals were tried to place an effect's events in all recordings."""
    if not EFFECTS[name].event:
        return 0.0
    acting = sum(to_s > from_s for from_s, to_s in moments_of(result, name))
    tried = 2.0 * MOST_CELLS if EFFECTS[name].lasting else 0.5 * MOST_CELLS**2
    return acting * math.log(tried)


def has_edge(name: str, result: FitResult) -> bool:
    """Tell whether an event begins or ends inside a recording.

    Where it would be another effect if it acted all along, not a glimpse of it counts, beside whole recordings.
    """
    acting = [
        (to_s - from_s, inside(record, from_s) or inside(record, to_s))
        for record, (from_s, to_s) in zip(result.problem.records, moments_of(result, name), strict=True)
        if to_s > from_s
    ]
    seen_s = sum(length_s for length_s, edged in acting if edged)
    least = PART_SEEN if EFFECTS[name].permanent else 0.0
    return seen_s > least * sum(length_s for length_s, _ in acting)


def healed_in(name: str, result: FitResult) -> str:
    """Return a recording within which a lasting step begins and ends; "" where there is none."""
    if not EFFECTS[name].lasting:
        return ""
    for record, (from_s, to_s) in zip(result.problem.records, moments_of(result, name), strict=True):
        if to_s > from_s and inside(record, from_s) and inside(record, to_s):
            return record.name
    return ""


def null_inside(name: str, result: FitResult, cov: FloatArray | None = None, hypotheses: int = 1) -> bool:
    """Tell whether the interval of every decisive parameter of an effect includes its null.

    See ``Effect.decisive``. A profile is decided by its gain alone: it has no single parameter. The interval is that of
    95 % for all ``hypotheses`` together (Bonferroni), by the covariance of the noise where no other is given.
    """
    entry = EFFECTS[name]
    if entry.profile:
        return False
    nulls = {parameter.name: parameter.null for parameter in entry.parameters}
    fitted = [i for i, s in enumerate(result.problem.shared) if s.effect == name and s.low < s.high]
    names = entry.decisive or tuple(entry.phases.values())
    decisive = [i for i in fitted if result.problem.shared[i].name in names]
    cov = covariance(result) if cov is None else cov
    wider = (float(stats.norm.isf(0.025 / hypotheses)) / Z95) ** 2
    return all(_includes(result, wider * cov, i, nulls[result.problem.shared[i].name]) for i in decisive or fitted[:1])


def _includes(result: FitResult, cov: FloatArray, index: int, null: float) -> bool:
    low, high = interval(result, cov, index)
    at_null = bool(np.isclose(result.x[index] * result.problem.shared[index].scale, null))
    return at_null or low <= null <= high
