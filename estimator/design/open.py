"""What recordings leave open: hypotheses and their odds, effects that were not tested, and when it is decided."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from estimator.diagnosis.inference.descent import covariance_of_innovations
from estimator.diagnosis.inference.hypotheses import Effects, Hypothesis
from estimator.physics.model import DrivelineModel
from estimator.signals.record import FloatArray, Record

STANDS = 0.05
"""Probability from which another explanation stands against the verdict: what one in twenty would be wrong by."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A hypothesis that recordings leave open."""

    name: str  # its effects joined by " + "; "nothing" for the nominal model re-tuned
    probability: float  # among the hypotheses that are open, as the judge counts odds
    fit: Hypothesis  # of the recordings, by all of their outputs
    precision: FloatArray  # (S, S): What recordings say of its shared unknowns
    moves: Mapping[str, float] = field(default_factory=dict)  # values outside the verdict's intervals: by what share

    @property
    def effects(self) -> Effects:
        """The effects of the catalogue that it adds."""
        return self.fit.effects


@dataclass(frozen=True, slots=True)
class Untested:
    """An effect that recordings neither show nor exclude, in the size at which a fit of it begins."""

    name: str  # key of the catalogue
    size: Mapping[str, float]  # values of its parameters, where they are not those at which the law does nothing
    supposed: Candidate  # the most probable hypothesis with it, its other unknowns fitted to the recordings
    moves: Mapping[str, float]  # values reported that leave their 95 % intervals with it: by what share of themselves


@dataclass(frozen=True, slots=True)
class Unnamed:
    """What the verdict leaves, as a law without a name."""

    place: str  # key of ``PLACES``
    fit: Candidate  # the verdict's set with it, the values of its curve among the unknowns
    line: DrivelineModel  # the re-tuned model with the curve


@dataclass(frozen=True, slots=True)
class Open:
    """What recordings leave open."""

    line: DrivelineModel  # the model without effects, as re-tuned
    candidates: tuple[Candidate, ...]  # the most probable first
    twins: Mapping[str, tuple[str, ...]]  # by effect: those that the recordings cannot distinguish from it
    untested: tuple[str, ...]  # effects that these recordings neither show nor exclude, and others could
    supposed: Mapping[str, Untested] = field(default_factory=dict)  # those of them that have a size to suppose
    named: Effects | None = None  # what the verdict names; None where it leaves something without a name
    traces: Effects = frozenset()  # seen, and too small to matter: with or without them, the verdict is the same
    unnamed: Unnamed | None = None  # a law without a name that makes the free run better, where one was found

    @property
    def records(self) -> tuple[Record, ...]:
        """The recordings so far, by their first outputs."""
        problem = self.candidates[0].fit.result.problem
        return problem.records[: len(problem.bases)]

    @property
    def foremost(self) -> tuple[Candidate, DrivelineModel]:
        """What simulates best, with the line it is added to: what an experiment is driven with on paper."""
        return (self.candidates[0], self.line) if self.unnamed is None else (self.unnamed.fit, self.unnamed.line)

    @property
    def against(self) -> tuple[Candidate, ...]:
        """Explanations other than the verdict's that are too probable for it to stand."""
        return tuple(
            each
            for each in self.candidates
            if each.probability > STANDS and each.effects - self.traces != (self.named or frozenset()) - self.traces
        )

    @property
    def is_decided(self) -> bool:
        """Whether the verdict explains the recordings, and no other explanation stands against it."""
        has_twins = any(name in self.twins for name in self.candidates[0].effects)
        return self.named is not None and not self.against and not has_twins


def name_of(effects: Effects) -> str:
    """Return a set of effects as one name."""
    return " + ".join(sorted(effects)) or "nothing"


def precision_of(hypothesis: Hypothesis) -> FloatArray:
    """Return what recordings say of a hypothesis' shared unknowns: their Fisher information, shape (S, S)."""
    count = len(hypothesis.result.problem.shared)
    spread = covariance_of_innovations(hypothesis)[:count, :count]
    free = np.diag(spread) > 0.0
    known = np.zeros((count, count))
    known[np.ix_(free, free)] = np.linalg.pinv(spread[np.ix_(free, free)], hermitian=True)
    return known
