"""What is hidden in each case of a set, drawn from one seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hil.proof.campaign.kinds import NOTHING, OFF, Group, Kind, kind, parse_kinds

SHARES = {Group.SINGLE: 0.5, Group.PAIR: 0.2, Group.OUTSIDE: 0.15, Group.OFF: 0.1, Group.NONE: 0.05}
"""How often each group is drawn: one effect of the catalogue in every second case."""

SEEDS = 2**31
"""Seeds of cases."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """What one case hides, and what its bus and sizes are drawn from."""

    name: str
    kind: Kind
    seed: int


def draw(cases: int, seed: int) -> list[Drawn]:
    """Draw what each of so many cases hides; equal seeds give equal draws, and the first of more are those of fewer."""
    return [_draw(number, np.random.default_rng([seed, number])) for number in range(1, cases + 1)]


def _draw(number: int, rng: np.random.Generator) -> Drawn:
    group = list(SHARES)[int(rng.choice(len(SHARES), p=list(SHARES.values())))]
    kinds = _kinds(group)
    hidden = kinds[int(rng.integers(len(kinds)))]
    return Drawn(f"case_{number:03d}", hidden, int(rng.integers(SEEDS)))


def _kinds(group: Group) -> list[Kind]:
    if group in (Group.NONE, Group.OFF):
        return [kind(NOTHING if group is Group.NONE else OFF)]
    return parse_kinds(group.value)
