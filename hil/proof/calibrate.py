"""``python -m hil.proof.calibrate --sets clean,dirty,quiet --seeds A..B --out DIR``: thresholds of a verdict, from cases.

Every case is searched once and what its decision rests on is kept in ``DIR/SET_SEED.json``: scores of all sets of
effects that were fitted, shares, and the tests of what is left. From these the thresholds follow, again and again if
need be, without another search; ``--write`` puts them, with this command, where the decision reads them
(``estimator/diagnosis/inference/thresholds.toml``). ``--judge A..B`` counts, on other seeds, what they lead to.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from estimator.diagnosis.inference import calibration
from estimator.diagnosis.inference.posterior import probability_of
from estimator.diagnosis.inference.verdict import Grounds, grounds
from estimator.errors import EstimatorError
from hil.proof.campaign.kinds import parse_seeds
from hil.proof.compare_engines import NOTHING, prepared_search

SETS = ("clean", "dirty", "quiet")

MOST_FALSE = 0.01
"""Share of named effects that may not be there."""

MOST_REFUSED = 0.01
"""Share of worlds of which all is explained that a test may refuse."""

ROUND_UP = 1.25
"""Factor from the quantile of a few hundred worlds to a limit: the tail of the next few hundred is longer."""


@dataclass(frozen=True, slots=True)
class Rest:
    """A case: what is in it, what its decision rests on, and how long the search took."""

    which: str
    seed: int
    strong: str
    hidden: list[str]
    known: list[str]
    grounds: Grounds
    cpu_s: float

    def is_there(self, names: Iterable[str]) -> bool:
        """Tell whether one of some effects is in the case, or known to the model file."""
        return bool({*names} & {*self.hidden, *self.known})

    @property
    def is_all_found(self) -> bool:
        """Whether the best set has what is hidden, as far as it is more than a trace, and nothing else."""
        claims = [each.names for each in self.grounds.effects]
        strong_found = self.strong == NOTHING or any(self.strong in names for names in claims)
        return strong_found and all(self.is_there(names) for names in claims)


def searched(which: str, seed: int) -> Rest | None:
    """Search a case; None where its recordings are refused."""
    began = time.process_time()
    try:
        search, chain, case, known, strong = prepared_search(which, seed)
        found = grounds(search)
    except EstimatorError:
        return None
    hidden = [name for name in case.specimen.sizes if name not in (NOTHING, *known)]
    hidden_behind_chain = [name for name in hidden if name not in {finding.name for finding in chain.findings}]
    return Rest(which, seed, strong, hidden_behind_chain, [*known], found, round(time.process_time() - began, 2))


def kept(place: Path, which: str, seed: int) -> Rest | None:
    """Return a case from its file, which is written where there is none yet."""
    path = place / f"{which}_{seed}.json"
    if not path.exists():
        rest = searched(which, seed)
        text = json.dumps(None if rest is None else asdict(rest))
        path.write_text(text, encoding="utf-8")
        sys.stdout.write(f"{which} {seed}: {rest and rest.cpu_s} s\n")
        sys.stdout.flush()
    entry = json.loads(path.read_text(encoding="utf-8"))
    return None if entry is None else Rest(**{**entry, "grounds": Grounds.read(entry["grounds"])})


def limits_of(cases: Sequence[Rest]) -> dict[str, float]:
    """Return the limit of each test of what is left: beyond what is seen where all is explained."""
    explained = [case.grounds.tests for case in cases if case.is_all_found]
    return {
        key: round(ROUND_UP * float(np.quantile([tests[key] for tests in explained], 1.0 - MOST_REFUSED)), 4)
        for key in calibration.LIMITS
    }


def tempered(cases: Sequence[Rest]) -> float:
    """Return by which differences of scores are to be divided for probabilities to be as often right as they say."""
    claims = [(case, each) for case in cases for each in case.grounds.effects]

    def surprise(log_factor: float) -> float:
        total = 0.0
        for case, each in claims:
            p = probability_of(each.names, case.grounds.scores, case.grounds.divisor(float(np.exp(log_factor))))
            p = min(max(p, 1e-6), 1.0 - 1e-6)
            total -= np.log(p if case.is_there(each.names) else 1.0 - p)
        return total

    return float(np.exp(minimize_scalar(surprise, bounds=(0.0, np.log(200.0)), method="bounded").x))


def least_probability(cases: Sequence[Rest], divided_by: float) -> float:
    """Return the probability from which on no more effects are false than may be."""
    claims = sorted(
        (probability_of(each.names, case.grounds.scores, case.grounds.divisor(divided_by)), case.is_there(each.names))
        for case in cases
        for each in case.grounds.effects
        if each.share >= calibration.LEAST_SHARE
    )
    there = np.array([right for _, right in claims])[::-1]
    false = np.cumsum(~there) / np.arange(1, there.size + 1)
    allowed = np.flatnonzero(false <= MOST_FALSE)
    least = claims[::-1][int(allowed[-1])][0] if allowed.size else 1.0
    return round(max(0.5, float(least)), 3)


def table(cases: Sequence[Rest], divided_by: float, least: float, limits: dict[str, float]) -> str:
    """Return what thresholds lead to, as a table in Markdown."""
    lines = ["| set | cases | strong named | names | false | cases with a false name | refused | CPU median, most [s] |"]
    lines.append("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for which in SETS:
        mine = [case for case in cases if case.which == which]
        if not mine:
            continue
        named = [(case, each) for case in mine for each in case.grounds.effects if case.names(each, divided_by, least)]
        lines.append(f"| {which} | {len(mine)} | {len(named)} |")
    return "\n".join(lines) + "\n"
