"""A verdict against the truth: right, wrong, or honestly undecided.

Reads ``diagnosis.json`` and an opened seal, nothing else: it judges what any user sees.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from hil.proof.compare import Comparison, compare

Json = Mapping[str, Any]

NOTHING = "none"


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
class Judgement:
    """What became of one verdict.

    Attributes
    ----------
    outcome : Outcome
    hidden, named : tuple of str
        Effects that were there, and that were named.
    sizes : tuple of Comparison
        The hidden sizes that can be compared, then the nominal model's parameters.
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
        sizes=tuple(compare(diagnosis, truth)),
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
