"""Look-alikes: effects that explain as much in a chosen effect's place, as far as the recordings can tell."""

from __future__ import annotations

from collections.abc import Sequence

from estimator.diagnosis.bench import Bench
from estimator.diagnosis.evidence import VERY_STRONG, gain, information
from estimator.diagnosis.hypotheses import Effects, with_effect
from estimator.diagnosis.screening import Screen, promising
from estimator.diagnosis.weight import PART_BESIDE
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult

SAME_PROMISE = 0.5
"""Share of what an effect explains that a first look must promise of its look-alike."""

NEARLY = 1.5
"""Squared error of a rival's rough fit, over the chosen one's, beyond which it is no look-alike."""


def lookalikes(name: str, chosen: Effects, current: FitResult, bench: Bench, names: Sequence[str]) -> tuple[str, ...]:
    """Return the effects that explain as much in an effect's place, as far as these recordings can tell.

    A rival that is beyond chance worse, but by less than any law is known to, is alike as well; so are its linear
    equivalents, whose law may be written for fewer cases than its own.
    """
    entry = EFFECTS[name]
    others = chosen - {name}
    kin = {*entry.resembles, *entry.equivalent} | {
        other for other in names if name in (*EFFECTS[other].resembles, *EFFECTS[other].equivalent)
    }
    rivals = [other for other in names if other in kin and other not in chosen and name not in EFFECTS[other].contains]
    alike = set(entry.equivalent)
    without = bench.fit(others, current)
    screen = Screen(without, bench.model)
    explained = min(without.squares - current.squares, screen.looks(name)[0].promise)  # a strong law bends
    known = PART_BESIDE * (without.squares - current.squares)
    n = gain(without, current).n_effective
    for rival in rivals:
        looks = screen.looks(rival)
        if looks[0].promise < SAME_PROMISE * explained:
            continue
        result = bench.rough_fit(with_effect(others, rival), without, [look.release for look in promising(looks)])
        if result.squares > NEARLY * current.squares:
            continue
        result = bench.fit(with_effect(others, rival), without)
        if information(result, current, n) < VERY_STRONG or result.squares - current.squares < known:
            alike |= {rival, *EFFECTS[rival].equivalent}
    return tuple(sorted(alike - chosen))
