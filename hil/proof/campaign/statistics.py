"""Rates with their uncertainty, and what else a campaign's rows add up to."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hil.proof.campaign.kinds import Group

Row = Mapping[str, Any]

Z95 = 1.959963984540054
"""Two-sided 95 % quantile of the standard normal distribution."""

NO_MISMATCH, ABSTAINED, FAILED = "(no mismatch)", "(no name)", "(failed)"
"""Columns of the confusion matrix besides the names."""


@dataclass(frozen=True, slots=True)
class Rate:
    """A share of trials with its 95 % interval."""

    hits: int
    trials: int

    @property
    def value(self) -> float:
        """Hits over trials; NaN without any."""
        return self.hits / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's score interval (J. Am. Stat. Assoc. 22, 1927); 0 to 1 without any trial."""
        n = self.trials
        if n == 0:
            return 0.0, 1.0
        middle = (self.hits + 0.5 * Z95**2) / (n + Z95**2)
        half = Z95 / (n + Z95**2) * math.sqrt(self.hits * (n - self.hits) / n + 0.25 * Z95**2)
        return max(0.0, middle - half), min(1.0, middle + half)

    def as_json(self) -> dict[str, Any]:
        """Return it for ``summary.json``."""
        low, high = self.interval
        return {"hits": self.hits, "trials": self.trials, "rate": finite(self.value), "ci95": [low, high]}


def finite(value: float) -> float | None:
    """Return a number as JSON can have it: rounded, None for NaN."""
    return round(value, 5) if math.isfinite(value) else None


def share(of: Iterable[bool]) -> Rate:
    """Count what is true."""
    flags = list(of)
    return Rate(sum(flags), len(flags))


def by_kind(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Group rows by what was planted, in the order in which it comes."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(row["kind"], []).append(row)
    return groups


def outcomes(rows: Sequence[Row]) -> dict[str, int]:
    """Count the outcomes, most frequent first."""
    return dict(Counter(row["outcome"] for row in rows).most_common())


def coverage(rows: Sequence[Row]) -> dict[str, Rate]:
    """Return how often each 95 % interval held the truth, by parameter; those without interval don't count."""
    inside: dict[str, list[bool]] = {}
    for row in rows:
        for size in row.get("sizes", ()):
            if size["inside"] is not None:
                inside.setdefault(size["what"], []).append(size["inside"])
    return {what: share(flags) for what, flags in sorted(inside.items())}


def banded(rows: Sequence[Row]) -> list[Mapping[str, Any]]:
    """Return the scores of the bands that have one (`hil.proof.campaign.band`)."""
    scores = [row.get("band") for row in rows]
    return [score for score in scores if score is not None and "right" in score]


def quantiles(values: Iterable[float | None], at: Sequence[float] = (0.5, 0.9, 1.0)) -> list[float | None]:
    """Return quantiles of finite values; None each without any."""
    known = [value for value in values if value is not None and math.isfinite(value)]
    return [finite(float(value)) for value in np.quantile(known, at)] if known else [None] * len(at)


def strongest_name(row: Row) -> str:
    """Return the column of the confusion matrix a row falls into."""
    if "verdict" not in row:
        return FAILED
    if row["named"]:
        return str(row["named"][0])
    return NO_MISMATCH if row["verdict"] == "no_mismatch" else ABSTAINED


def confusion(rows: Sequence[Row]) -> dict[str, Counter[str]]:
    """Return planted kind to counts of the strongest effect named; pairs are left out."""
    single = [row for row in rows if row["group"] != Group.PAIR.value]
    return {kind: Counter(map(strongest_name, group)) for kind, group in by_kind(single).items()}


def columns(matrix: Mapping[str, Counter[str]]) -> list[str]:
    """Return the matrix's columns: what was planted first, in its order, then other names, then no name."""
    named = {name for counts in matrix.values() for name in counts}
    special = [name for name in (NO_MISMATCH, ABSTAINED, FAILED) if name in named]
    planted = [kind for kind in matrix if kind in named]
    return planted + sorted(named - set(planted) - set(special)) + special
