"""``python -m tests.campaigns.calibrate --seeds A..B --out DIR``: what a verdict counts by, from simulated worlds.

Every world is decided once; what the decision rests on is kept in ``DIR/decided.jsonl``. From worlds of which all is
explained follow the limits of the noise tests, from all of them the divisor of scores by which experiments are
designed. ``--names worlds.jsonl``, rows of ``tests.campaigns.worlds``, counts how many names were there, by the lower
end of their necessity. ``--write`` puts all of that where the decision reads it.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar
from threadpoolctl import threadpool_limits

from estimator.diagnosis.diagnose import SearchResult, answer
from estimator.diagnosis.inference.hypotheses import silent
from estimator.diagnosis.inference.remainder import chance, tests
from estimator.diagnosis.preconditions.prepare import prepare
from estimator.diagnosis.result import Counted
from estimator.diagnosis.thresholds import THRESHOLDS_FILE, Checks
from estimator.errors import EstimatorError
from estimator.physics.parallel import Work
from hil.proof.truth.specimen import NOTHING
from tests.campaigns.forms import Role
from tests.campaigns.worlds import ALL, Row, continued, parse_forms, parse_seeds, world_of

MOST_REFUSED = 0.01
"""Share of worlds of which all is explained that one test may refuse."""

OTHER_FORMS = {"most_predictable": 0.03, "most_dependent": 0.015}
"""Shares of the innovations' variance that machines leave by the form of their laws alone: simulated worlds are nearer
to the model than any real one. Set by hand, from the real recordings in docs/how-good.md."""

USUAL_DIVISOR, DIVISOR_SPREAD, MOST_DIVISOR = 4.0, 0.5, 100.0
"""Prior of the divisor of scores, log-normal, and its bound: a few hundred worlds of one simulator with hardly a false
effect among them do not tell how far other worlds are from the laws."""

NECESSITIES = (0.0, 0.7, 0.9, math.inf)
"""Lower ends of necessity between which names are counted together."""

FEWEST_NAMES = 20  # names of a count of its own; fewer are counted with those that are needed less


@dataclass(frozen=True, slots=True)
class World:
    """A world that was decided: what is in it, what was claimed, and what other sets are worth."""

    form: str
    seed: int
    strong: str
    there: list[str]
    claims: list[tuple[list[str], bool]]  # an effect with its look-alikes, and whether it is established
    scores: list[tuple[list[str], float]]  # of each plausible set
    tests: dict[str, float]  # what each test finds, beyond what it finds in noise by chance

    def is_there(self, names: Sequence[str]) -> bool:
        """Tell whether one of some look-alikes is in the world or known to the model file."""
        return bool({*names} & {*self.there})

    @property
    def is_explained(self) -> bool:
        """Whether what is strong is established, and nothing that is not there."""
        established = [names for names, is_established in self.claims if is_established]
        strong = self.strong == NOTHING or any(self.strong in names for names in established)
        return strong and all(map(self.is_there, established))

    def probability(self, names: Sequence[str], divisor: float) -> float:
        """Return the probability of one of some look-alikes over all sets, their differences divided by a number."""
        values = np.array([score for _, score in self.scores])
        holds = np.array([bool({*names} & {*effects}) for effects, _ in self.scores])
        weights = np.exp(-0.5 * (values - values.min()) / divisor)
        return float(weights[holds].sum() / weights.sum())


def decided(form: str, seed: int) -> Row | None:
    """Decide a world; None where its recordings are refused."""
    world, kept = world_of(form, seed), list[SearchResult]()
    try:
        ready = prepare(world.records, world.model)
    except EstimatorError:
        return None
    with threadpool_limits(1, user_api="blas"):  # as a diagnosis does
        answer(ready, world.model, silent, "normal", Work(), kept.append)
    fits, judged = kept[0].search.fits, kept[0].decision.judged
    recognised = {finding.name for finding in kept[0].chain.findings}
    there = {name for name in world.case.specimen.sizes if name != NOTHING} - recognised
    established = (*judged.named, *judged.traces)
    samples = judged.believed.hypothesis.result.residual.size
    return asdict(
        World(
            form,
            seed,
            NOTHING if world.strong in recognised else world.strong,
            sorted(there | {*world.known}),
            [([each.name, *each.alike], each in established) for each in (*established, *judged.refinements)],
            [(sorted(each.effects), each.score) for each in fits.ended.values() if each.is_plausible],
            {t.key: t.value - chance(t.key, samples) for t in tests(judged.believed.hypothesis) if t.key},
        )
    )


def decided_worlds(out: Path, forms: Sequence[str], seeds: range) -> list[World]:
    """Return the worlds of some forms and seeds that were not refused; each is decided once."""
    wanted = {f"{form} {seed}": (form, seed) for seed, form in product(seeds, forms)}
    rows = continued(out / "decided.jsonl", list(wanted), lambda name: {"world": decided(*wanted[name])})
    return [World(**row["world"]) for row in rows if row["world"] is not None]


def limits_of(worlds: Sequence[World]) -> dict[str, float]:
    """Return how far an error may be from noise, by the worlds of which all is explained."""
    explained = [world for world in worlds if world.is_explained]
    found = {
        key: float(np.quantile([world.tests[key] for world in explained], 1.0 - MOST_REFUSED))
        for key in Checks.TEST_LIMITS
    }
    return {key: max(limit, OTHER_FORMS.get(key, 0.0)) for key, limit in found.items()}


def divisor_of(worlds: Sequence[World]) -> float:
    """Return the divisor of scores that makes what is there, and what is not, most probable."""

    def surprise(log: float) -> float:
        total = 0.5 * ((log - math.log(USUAL_DIVISOR)) / DIVISOR_SPREAD) ** 2
        for world in worlds:
            for names, _ in world.claims:
                p = min(max(world.probability(names, math.exp(log)), 1e-6), 1.0 - 1e-6)
                total -= math.log(p if world.is_there(names) else 1.0 - p)
        return total

    return math.exp(minimize_scalar(surprise, bounds=(0.0, math.log(MOST_DIVISOR))).x)


def counted(rows: Sequence[Row]) -> list[tuple[float, Counted]]:
    """Return how many names were there, by the lower end of their necessity; faults of readings have none."""
    names = [name for row in rows for name in row["names"] if name["least"] is not None]
    found: list[tuple[float, Counted]] = []
    for low, high in pairwise(NECESSITIES):
        inside = [name["is_there"] for name in names if low <= name["least"] < high]
        new = Counted(sum(inside), len(inside))
        if found and new.of < FEWEST_NAMES:
            before, last = found.pop()
            found.append((before, Counted(last.right + new.right, last.of + new.of)))
        else:
            found.append((low, new))
    return found


def written(text: str, values: Mapping[str, float], counts: Sequence[tuple[float, Counted]] = ()) -> str:
    """Return the text of the thresholds with some of its values, and with other counts, if any; comments stay."""
    for key, value in values.items():
        text = re.sub(rf"^{key} = \S+", f"{key} = {value:.3g}", text, flags=re.MULTILINE)
    if counts:
        tables = [f"necessity_from = {low:g}\nright = {each.right}\nof = {each.of}\n" for low, each in counts]
        head = re.search(r"^\[\[counted\]\].*\n", text, re.MULTILINE)
        assert head is not None
        among = re.compile(r"(?:^\[\[counted\]\].*\n(?:\w.*\n)+\n?)+", re.MULTILINE)
        text = among.sub(lambda _: "".join(f"{head.group()}{table}\n" for table in tables), text)
    return text


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.campaigns.calibrate", description="Count what a verdict goes by, in simulated worlds."
    )
    parser.add_argument("--forms", default=parse_forms("calibrate"), type=parse_forms, help="forms that calibrate")
    parser.add_argument("--seeds", required=True, type=parse_seeds, help="A..B: the worlds that calibrate")
    parser.add_argument("--names", type=Path, help="worlds.jsonl of tests.campaigns.worlds: the names to count")
    parser.add_argument("--out", required=True, type=Path, help="folder for what was decided in each world")
    parser.add_argument("--write", action="store_true", help="put the values where the decision reads them")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Decide what worlds have not been decided, and calibrate; return the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if judging := [form for form in options.forms if ALL[form] is not Role.CALIBRATE]:
        parser.error(f"--forms: expected forms that calibrate, got {', '.join(judging)}: those judge")
    options.out.mkdir(parents=True, exist_ok=True)
    worlds = decided_worlds(options.out, options.forms, options.seeds)
    lines = options.names.read_text(encoding="utf-8").splitlines() if options.names else []
    counts = counted([json.loads(line)["row"] for line in lines])
    values = limits_of(worlds) | {"tempered": divisor_of(worlds)}
    text = written(THRESHOLDS_FILE.read_text(encoding="utf-8"), values, counts if options.names else ())
    sys.stdout.write(text)
    if options.write:
        THRESHOLDS_FILE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
