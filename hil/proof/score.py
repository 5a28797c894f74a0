"""Score of a case: name, element, time, sizes, and how the augmented model does on fresh recordings; rates of many."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest

from estimator.physics.catalogue import EFFECTS as CATALOGUE
from hil.proof.judge import Judgement, Outcome, judge
from hil.proof.kinds import CaseKind, Group
from hil.proof.truth.specimen import NOTHING

Json = Mapping[str, Any]
Row = Mapping[str, Any]
Intervals = Sequence[Sequence[float]]

LOOK_ALIKE = "alike"
"""Outcome besides those of `Outcome`: right, by way of an effect declared to be the same to torque and speed."""

FAILED = "failed"  # outcome besides those of `Outcome`: a command gave no result
RESOLUTION_S = 0.01  # intervals are compared on a grid of one sample

RECORDING_S = 30.0


@dataclass(frozen=True, slots=True)
class Answer:
    """What the command made of a case."""

    diagnosis: Json | None  # content of ``diagnosis.json``
    # of each fresh recording, as `fresh_over_floor` returns it; empty where none was simulated
    fresh_over_floor: Sequence[float] = ()
    diagnose_s: float = 0.0  # time taken [s], start of the process included
    fault: str | None = None  # why a command did not do its job


def score(kind: CaseKind, seed: int, truth: Json, answer: Answer) -> dict[str, Any]:
    """Return the row of one case in ``results.jsonl``; JSON types only."""
    row: dict[str, Any] = {
        "kind": kind.name,
        "group": kind.group.value,
        "seed": seed,
        "outcome": FAILED,
        "success": False,
        "fault": answer.fault,
        "diagnose_s": round(answer.diagnose_s, 2),
        "fresh_over_floor": [finite(value) for value in answer.fresh_over_floor],
        "hidden": truth["hidden"],
    }
    if answer.diagnosis is None:
        return row
    diagnosis = _with_all_equivalents(answer.diagnosis)
    judgement = judge(diagnosis, truth)
    outcome = _outcome(judgement)
    return {
        **row,
        "outcome": outcome,
        "success": is_success(kind.group, outcome),
        "verdict": diagnosis["verdict"],
        "named": [effect["name"] for effect in diagnosis["effects"]],
        "element": diagnosis["mismatch"]["element"],
        "element_right": _element_right(diagnosis, truth),
        "event_iou": _event_ious(diagnosis, truth),
        "sizes": [{**asdict(size), "inside": size.inside} for size in judgement.sizes],
        "fit": dict(diagnosis["fit"]),
    }


def is_success(group: Group, outcome: str) -> bool:
    """Say whether an outcome is what a group's cases should end in."""
    if group is Group.OUTSIDE:
        return outcome == _name(Outcome.ABSTAINED)
    return outcome in (_name(Outcome.RIGHT), LOOK_ALIKE)


def _name(outcome: Outcome) -> str:
    return outcome.name.lower()


def _with_all_equivalents(diagnosis: Json) -> dict[str, Any]:
    """Declare effects alike in both directions: that one lists the other is enough."""
    effects = []
    for effect in diagnosis["effects"]:
        name = effect["name"]
        listing = [other for other, entry in CATALOGUE.items() if name in entry.equivalent]
        alike = list(dict.fromkeys([*effect["indistinguishable_from"], *listing]))
        effects.append({**effect, "indistinguishable_from": alike})
    return {**diagnosis, "effects": effects}


def _outcome(judgement: Judgement) -> str:
    if judgement.outcome is Outcome.RIGHT and set(judgement.named) != set(judgement.hidden):
        return LOOK_ALIKE
    return _name(judgement.outcome)


def _element_right(diagnosis: Json, truth: Json) -> bool | None:
    """Compare elements: of the strongest mismatch, and of all that was named; None where nothing is hidden."""
    if truth["effect"] == NOTHING:
        return None
    elements = set(truth["element"])
    named = {effect["element"] for effect in diagnosis["effects"]}
    return diagnosis["mismatch"]["element"] in elements and named <= elements


def _event_ious(diagnosis: Json, truth: Json) -> dict[str, float]:
    """Mean over the recordings of intersection over union, for each event that was named and given times."""
    given = {effect["name"]: effect["time_s"] for effect in diagnosis["effects"] if effect["time_s"]}
    ious = {}
    for name, recordings in truth["events"].items():
        if name in given:
            runs = [run for run in recordings if run.startswith("run_")]
            ious[name] = float(np.mean([iou(given[name].get(run, []), recordings[run]) for run in runs]))
    return ious


def iou(found: Intervals, true: Intervals) -> float:
    """Return the time in both sets of intervals over the time in either; 1 where both are empty."""
    time_s = np.arange(0.5 * RESOLUTION_S, RECORDING_S, RESOLUTION_S)
    a, b = _inside(time_s, found), _inside(time_s, true)
    either = np.count_nonzero(a | b)
    return 1.0 if either == 0 else float(np.count_nonzero(a & b) / either)


def _inside(time_s: np.ndarray[Any, Any], intervals: Intervals) -> np.ndarray[Any, Any]:
    inside = np.zeros(time_s.shape, dtype=np.bool_)
    for begin, end in intervals:
        inside |= (time_s >= begin) & (time_s <= end)
    return inside


@dataclass(frozen=True, slots=True)
class Rate:
    """A share of trials with its 95 % interval."""

    hits: int  # of the trials
    trials: int  # 0: nothing is known

    @property
    def value(self) -> float:
        """Hits over trials; NaN without any."""
        return self.hits / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's score interval (J. Am. Stat. Assoc. 22, 1927); 0 to 1 without any trial."""
        if not self.trials:
            return 0.0, 1.0
        interval = binomtest(self.hits, self.trials).proportion_ci(method="wilson")
        return float(interval.low), float(interval.high)

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


def quantiles(values: Iterable[float | None], at: Sequence[float] = (0.5, 0.9, 1.0)) -> list[float | None]:
    """Return quantiles of finite values; None each without any."""
    known = [value for value in values if value is not None and math.isfinite(value)]
    return [finite(float(value)) for value in np.quantile(known, at)] if known else [None] * len(at)
