"""``python -m tests.campaigns.calibrate --seeds A..B --judge C..D --out DIR``: thresholds of a verdict, by simulation.

Every world is searched once; what its decision rests on is kept in ``DIR/searched.jsonl``: scores of all sets of
effects that were fitted, shares, tests of what is left. The thresholds follow from these, again and again without
another search: limits of the tests from worlds of which all is explained, the divisor of scores by likelihood of what
is there, the least probability from the share of names that may be false. Other forms of world judge them
(`tests.campaigns.worlds.ALL`). ``--write`` puts them where the decision reads them, with this command.
"""

from __future__ import annotations

import argparse
import math
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import numpy as np
from estimator.diagnosis.inference.judge import Score, probability_of
from scipy.optimize import minimize_scalar
from threadpoolctl import threadpool_limits

from estimator.diagnosis.acquisition.chain import mechanical, read_through
from estimator.diagnosis.inference.answer import LEVELS, searched as searched_for
from estimator.diagnosis.inference.checks import COLUMNS, LEAST_SHARE, TEST_LIMITS, THRESHOLDS_FILE, chance
from estimator.diagnosis.inference.rivals import rivals_of
from estimator.diagnosis.preconditions.prepare import prepare
from estimator.errors import EstimatorError
from hil.proof.truth.specimen import NOTHING
from tests.campaigns.forms import Role
from tests.campaigns.worlds import ALL, Row, continued, parse_forms, parse_seeds, world_of

MOST_FALSE = 0.01
"""Share of named effects that may not be there."""

MOST_REFUSED = 0.01
"""Share of worlds of which all is explained that one test may refuse."""

OTHER_FORMS = {"most_predictable": 0.03, "most_dependent": 0.015}
"""Shares of the innovations' variance that machines leave by the form of their laws alone: simulated worlds are nearer
to the model than any real one. Set by hand, from the real recordings in docs/how-good.md."""

BELIEVED = 0.9
"""Probability below which nothing is reported as found, however well it went in simulated worlds."""

USUAL_DIVISOR, DIVISOR_SPREAD, MOST_DIVISOR = 4.0, 0.5, 100.0
"""Prior of the divisor of scores, log-normal, and its bound: a few hundred worlds of one simulator with hardly a false
effect among them do not tell how far other worlds are from the laws."""


@dataclass(frozen=True, slots=True)
class Claim:
    """An effect of the best set: the names it stands for, and its share of the re-tuned model's squared error."""

    name: str
    names: list[str]
    share: float


@dataclass(frozen=True, slots=True)
class World:
    """A world that was searched: what is in it, and what its decision rests on."""

    form: str
    seed: int
    strong: str
    there: list[str]
    claims: list[Claim]
    scores: list[tuple[list[str], float, bool]]
    tests: dict[str, float]
    samples: int
    cpu_s: float

    def is_there(self, claim: Claim) -> bool:
        """Tell whether an effect, or one it can't be distinguished from, is in the world or known to the model file."""
        return bool({*claim.names} & {*self.there})

    @property
    def is_explained(self) -> bool:
        """Whether the best set holds what is strong, and nothing that is not there."""
        strong = self.strong == NOTHING or any(self.strong in claim.names for claim in self.claims)
        return strong and all(map(self.is_there, self.claims))

    @property
    def weighty(self) -> list[Claim]:
        """The claims with a share that is no trace."""
        return [claim for claim in self.claims if claim.share >= LEAST_SHARE]

    def beyond_chance(self, key: str) -> float:
        """Return what a test found, less what it finds in noise by chance."""
        return self.tests[key] - chance(key, self.samples)

    def probability(self, claim: Claim, thresholds: Thresholds) -> float:
        """Return the probability of an effect under some thresholds."""
        lost = max(0.0, *(self.beyond_chance(key) - thresholds.limits[key] for key in COLUMNS))
        scores = [Score(frozenset(effects), score, plausible) for effects, score, plausible in self.scores]
        return probability_of(claim.names, scores, thresholds.divisor + self.samples * lost)

    def named(self, thresholds: Thresholds) -> list[Claim]:
        """Return the effects that are named under some thresholds."""
        least = thresholds.least_probability
        return [claim for claim in self.weighty if self.probability(claim, thresholds) >= least]


@dataclass(frozen=True, slots=True)
class Thresholds:
    """What a decision is made by: limits of the tests, divisor of scores, least probability."""

    limits: dict[str, float]
    divisor: float = 1.0
    least_probability: float = 0.0


def searched(form: str, seed: int) -> Row | None:
    """Search a world; None where its recordings are refused."""
    began = time.process_time()
    world = world_of(form, seed)
    try:
        ready = prepare(world.records, world.model)
    except EstimatorError:
        return None
    line, chain = mechanical(world.model), read_through(ready.records)
    with threadpool_limits(1, user_api="blas"):  # as a diagnosis does
        whole = searched_for(chain, line, most=LEVELS["normal"])
        rivals = rivals_of(whole.search, whole.grounds).scores
    found, recognised = whole.grounds, {finding.name for finding in whole.chain.findings}
    there = {name for name in world.case.specimen.sizes if name != NOTHING} - recognised
    return asdict(
        World(
            form,
            seed,
            NOTHING if world.strong in recognised else world.strong,
            sorted(there | {*world.known}),
            [Claim(each.name, sorted(each.names), each.share) for each in found.beliefs],
            [(sorted(each.effects), each.score, each.is_plausible) for each in (*found.scores, *rivals)],
            {test.key: test.value for test in found.tests if test.key},
            found.best.result.residual.size,
            round(time.process_time() - began, 2),
        )
    )


def searched_worlds(out: Path, forms: Sequence[str], seeds: range) -> list[World]:
    """Return the worlds of some forms and seeds that were not refused; each is searched once."""
    wanted = {f"{form} {seed}": (form, seed) for seed, form in product(seeds, forms)}
    rows = continued(out / "searched.jsonl", list(wanted), lambda name: {"world": searched(*wanted[name])})
    found = [row["world"] for row in rows if row["world"] is not None]
    return [World(**{**entry, "claims": [Claim(**claim) for claim in entry["claims"]]}) for entry in found]


def calibrated(worlds: Sequence[World]) -> Thresholds:
    """Return the thresholds that follow from some worlds."""
    explained = [world for world in worlds if world.is_explained]
    limits = {
        key: max(
            float(np.quantile([world.beyond_chance(key) for world in explained], 1.0 - MOST_REFUSED)),
            OTHER_FORMS.get(key, 0.0),
        )
        for key in TEST_LIMITS
    }
    divisor = _most_probable(lambda divisor: _surprise(worlds, Thresholds(limits, divisor)))
    least = _least_probability(worlds, Thresholds(limits, divisor))
    return Thresholds(limits, divisor, least)


def _most_probable(surprise: Callable[[float], float]) -> float:
    def posterior(log: float) -> float:
        return surprise(math.exp(log)) + 0.5 * ((log - math.log(USUAL_DIVISOR)) / DIVISOR_SPREAD) ** 2

    return math.exp(minimize_scalar(posterior, bounds=(0.0, math.log(MOST_DIVISOR))).x)


def _surprise(worlds: Sequence[World], thresholds: Thresholds) -> float:
    """Return minus the log-likelihood of what is there and what is not, by the probabilities that are stated.

    Those are of effects that can be named; of traces no probability is stated.
    """
    total = 0.0
    for world in worlds:
        for claim in world.weighty:
            p = min(max(world.probability(claim, thresholds), 1e-6), 1.0 - 1e-6)
            total -= float(np.log(p if world.is_there(claim) else 1.0 - p))
    return total


def _least_probability(worlds: Sequence[World], thresholds: Thresholds) -> float:
    """Return the least probability above which no more names are false than may be; not below `BELIEVED`."""
    weighty = [(world, claim) for world in worlds for claim in world.weighty]
    stated = sorted(((w.probability(c, thresholds), w.is_there(c)) for w, c in weighty), reverse=True)
    false = np.cumsum([not there for _, there in stated])
    allowed = np.flatnonzero(false <= MOST_FALSE * np.arange(1, false.size + 1))
    if not allowed.size:
        return 1.0
    return BELIEVED if allowed[-1] == false.size - 1 else max(BELIEVED, stated[int(allowed[-1])][0])


def table(worlds: Sequence[World], thresholds: Thresholds) -> str:
    """Return what thresholds lead to, as a table in Markdown."""
    lines = [
        "| form | worlds | strong named | names | of them false | worlds without a false name |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for form in dict.fromkeys(world.form for world in worlds):
        mine = [(world, world.named(thresholds)) for world in worlds if world.form == form]
        strong = [(w, named) for w, named in mine if w.strong != NOTHING]
        right = sum(any(w.strong in claim.names for claim in named) for w, named in strong)
        false = [sum(not w.is_there(claim) for claim in named) for w, named in mine]
        lines.append(
            f"| {form} | {len(mine)} | {right} of {len(strong)} | {sum(len(named) for _, named in mine)} | "
            f"{sum(false)} | {sum(not count for count in false)} |"
        )
    return "\n".join(lines) + "\n"


def written(thresholds: Thresholds, command: str) -> str:
    """Return the thresholds as the file that the decision reads."""
    lines = [
        "# Thresholds of a verdict by likelihood, from simulated worlds (docs/diagnosis.md); written by",
        f"# {command}",
        f"tempered = {thresholds.divisor:.3g}",
        f"least_probability = {thresholds.least_probability:.4g}{_choice(thresholds.least_probability == BELIEVED)}",
        *(f"{key} = {limit:.3g}{_choice(limit == OTHER_FORMS.get(key))}" for key, limit in thresholds.limits.items()),
    ]
    return "\n".join(lines) + "\n"


def _choice(is_one: bool) -> str:
    """Return what marks a threshold that worlds would let be lower: its floor is a choice."""
    return "  # a choice, with its reason in tests/campaigns/calibrate.py" if is_one else ""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.campaigns.calibrate",
        description="Calibrate the thresholds of a verdict on some forms of worlds, and judge them on others.",
    )
    parser.add_argument("--forms", default=parse_forms("calibrate"), type=parse_forms, help="forms that calibrate")
    parser.add_argument("--seeds", required=True, type=parse_seeds, help="A..B: the worlds that calibrate")
    parser.add_argument("--judge", type=parse_seeds, help="C..D: worlds of the forms that judge")
    parser.add_argument("--out", required=True, type=Path, help="folder for what was found in each world")
    parser.add_argument("--write", action="store_true", help="put the thresholds where the decision reads them")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Search what worlds have not been searched, calibrate and judge; return the exit status."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    parser = _parser()
    options = parser.parse_args(given)
    if judging := [form for form in options.forms if ALL[form] is not Role.CALIBRATE]:
        parser.error(f"--forms: expected forms that calibrate, got {', '.join(judging)}: those judge")
    options.out.mkdir(parents=True, exist_ok=True)
    worlds = searched_worlds(options.out, options.forms, options.seeds)
    thresholds = calibrated(worlds)
    text = written(thresholds, shlex.join(["python", "-m", "tests.campaigns.calibrate", *given]))
    sys.stdout.write(text)
    if options.write:
        THRESHOLDS_FILE.write_text(text, encoding="utf-8")
    sys.stdout.write(table(worlds, thresholds))
    if options.judge is not None:
        sys.stdout.write(table(searched_worlds(options.out, parse_forms("judge"), options.judge), thresholds))
    return 0


if __name__ == "__main__":
    sys.exit(main())
