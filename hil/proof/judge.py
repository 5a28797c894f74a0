"""A verdict against the truth: right, wrong, or honestly undecided.

Reads ``diagnosis.json`` and an opened seal, nothing else: it judges what any user sees.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

Json = Mapping[str, Any]

NOTHING = "none"

SAME_SIZE = {
    ("coulomb_friction_motor", "coulomb_nm"): "friction_nm",
    ("stribeck_friction", "coulomb_nm"): "coulomb_nm",
    ("stribeck_friction", "stribeck_speed_rad_s"): "stribeck_rad_s",
    ("backlash", "gap_rad"): "gap_rad",
    ("actuator_lag", "current_loop_time_s"): "time_constant_s",
    ("transport_delay", "delay_s"): "delay_s",
}
"""Sizes of the truth that the fitted law has too, by its name for them. Other laws are other formulations."""


class Outcome(Enum):
    """How a verdict stands to the truth."""

    RIGHT = "right"
    FALSE_CLAIM = "right, but something more was claimed that is not there"
    INCOMPLETE = "incomplete: only some of what was hidden was named"
    WRONG = "wrong: another effect was named"
    INVENTED = "wrong: an effect was named where nothing was hidden"
    MISSED = "wrong: an effect was hidden and no mismatch was seen"
    ABSTAINED = "abstained: a mismatch was seen and no name was given to it"


@dataclass(frozen=True, slots=True)
class Comparison:
    """One true size next to the estimated one; ``inside`` says whether the 95 % interval holds the truth."""

    what: str
    unit: str
    true: float
    found: float
    ci95: tuple[float, float] | None

    @property
    def inside(self) -> bool | None:
        """None where no interval was given."""
        return None if self.ci95 is None else self.ci95[0] <= self.true <= self.ci95[1]


@dataclass(frozen=True, slots=True)
class Judgement:
    """What became of one verdict.

    Attributes
    ----------
    outcome : Outcome
    hidden, named : tuple of str
        Effects that were there, and that were named.
    sizes : tuple of Comparison
        The hidden sizes that can be compared, then the six parameters.
    """

    outcome: Outcome
    hidden: tuple[str, ...]
    named: tuple[str, ...]
    sizes: tuple[Comparison, ...]


def judge(diagnosis: Json, truth: Json) -> Judgement:
    """Compare a diagnosis with the truth.

    Parameters
    ----------
    diagnosis
        Content of ``diagnosis.json``.
    truth
        Of the opened and verified seal.
    """
    hidden = tuple(name for name in truth["effect"].split("+") if name != NOTHING)
    named = tuple(effect["name"] for effect in diagnosis["effects"])
    return Judgement(
        outcome=_outcome(diagnosis, set(hidden)),
        hidden=hidden,
        named=named,
        sizes=(*_hidden_sizes(diagnosis, truth), *_parameters(diagnosis, truth)),
    )


def _outcome(diagnosis: Json, hidden: set[str]) -> Outcome:
    claims = [{effect["name"], *effect["indistinguishable_from"]} for effect in diagnosis["effects"]]
    met = {name for name in hidden if any(name in claim for claim in claims)}
    false_claims = [claim for claim in claims if not claim & hidden]
    if not hidden:
        return _where_nothing_is_hidden(diagnosis, bool(claims))
    if met == hidden:
        return Outcome.FALSE_CLAIM if false_claims else Outcome.RIGHT
    if claims:
        return Outcome.INCOMPLETE if met and not false_claims else Outcome.WRONG
    return Outcome.MISSED if diagnosis["verdict"] == "no_mismatch" else Outcome.ABSTAINED


def _where_nothing_is_hidden(diagnosis: Json, something_named: bool) -> Outcome:
    if something_named:
        return Outcome.INVENTED
    return Outcome.RIGHT if diagnosis["verdict"] == "no_mismatch" else Outcome.ABSTAINED


def _hidden_sizes(diagnosis: Json, truth: Json) -> list[Comparison]:
    found = {effect["name"]: effect["parameters"] for effect in diagnosis["effects"]}
    return [
        _comparison(f"{effect}: {size}", true, found[effect][SAME_SIZE[effect, size]])
        for effect, sizes in truth["hidden"].items()
        for size, true in sizes.items()
        if (effect, size) in SAME_SIZE and SAME_SIZE[effect, size] in found.get(effect, {})
    ]


def _parameters(diagnosis: Json, truth: Json) -> list[Comparison]:
    return [
        _comparison(name, truth["true"][name], entry)
        for name, entry in diagnosis["parameters"].items()
        if name in truth["true"]
    ]


def _comparison(what: str, true: float, entry: Json) -> Comparison:
    low, high = entry["ci95"] or (None, None)
    interval = None if low is None or high is None else (low, high)
    return Comparison(what, entry["unit"], true, entry["value"], interval)
