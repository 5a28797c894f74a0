"""What speaks for an effect: how much the simulation needs it, and how often a name of such a standing was right.

The likelihood's odds of a second law next to a first one grow with what the first law's form leaves, without a bound,
so no probability is computed from them. How sure a name is was counted: of names of such a necessity, in worlds that
chose no threshold, so many were there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from estimator.diagnosis.result import Counted
from estimator.diagnosis.thresholds import THRESHOLDS

COUNTED: Sequence[tuple[float, Counted]] = [
    (row["necessity_from"], Counted(row["right"], row["of"])) for row in THRESHOLDS["counted"]
]
"""Of names whose necessity (its lower end) is from so much up to that of the next row: the count."""


@dataclass(frozen=True, slots=True)
class Necessity:
    """Which share of the squared error beyond the noise comes back without a law, on samples that no fit has seen."""

    value: float  # estimate, as a share of 1
    least: float  # lower end of its one-sided 95 % interval, by the scatter of the blocks


@dataclass(frozen=True, slots=True)
class Standing:
    """What speaks for one effect of a set."""

    name: str  # key of the catalogue
    necessity: Necessity  # of this effect, within its set
    share: float  # of the re-tuned model's squared free-run error on unseen samples, that comes back without it
    evidence: float  # by which the score rises without it
    alike: Mapping[str, Mapping[str, float]]  # effects that explain as much in its place, with their values there
    objection: str = ""  # why it is not established; "" where it is
    slight: str = ""  # why it is a trace though established; "" where it is a name

    @property
    def counted(self) -> Counted:
        """How many names of such a necessity were there."""
        return next((count for least, count in reversed(COUNTED) if self.necessity.least >= least), COUNTED[0][1])

    @property
    def probability(self) -> float:
        """Probability that this effect, or one that it can't be distinguished from, is there."""
        return self.counted.probability
