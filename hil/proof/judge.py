"""A verdict against the truth: right, wrong, or honestly undecided.

Reads ``diagnosis.json`` and an opened seal, nothing else: it judges what any user sees.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from hil.proof.truth.specimen import EFFECTS, NOTHING

Json = Mapping[str, Any]


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

    what: str  # parameter, with its effect before it
    unit: str  # as diagnosis.json has it
    true: float  # by the seal
    found: float  # by the diagnosis
    ci95: tuple[float, float] | None  # None where none was given, or one end is not finite

    @property
    def inside(self) -> bool | None:
        """None where no interval was given."""
        return None if self.ci95 is None else self.ci95[0] <= self.true <= self.ci95[1]


def compare(diagnosis: Json, truth: Json) -> list[Comparison]:
    """Hold every size of a hidden effect that was named, and every nominal parameter, against the truth.

    An effect that is not registered, of a seal that another version made, has no sizes to compare.
    """
    found = {effect["name"]: effect["parameters"] for effect in diagnosis["effects"]}
    sizes = [
        _comparison(f"{effect}: {name}", true, found[effect][name])
        for effect, hidden in truth["hidden"].items()
        if effect in EFFECTS
        for name in EFFECTS[effect].fitted
        if _is_given(found.get(effect, {}), name)
        and (true := EFFECTS[effect].should_be(name, hidden, truth["true"])) is not None
    ]
    parameters = [
        _comparison(name, truth["true"][name], entry)
        for name, entry in diagnosis["parameters"].items()
        if name in truth["true"] and _is_given(diagnosis["parameters"], name)
    ]
    return sizes + parameters


def _is_given(entries: Json, name: str) -> bool:
    """Say whether a parameter has a value: one that isn't finite is null in ``diagnosis.json``."""
    return name in entries and entries[name]["value"] is not None


def _comparison(what: str, true: float, entry: Json) -> Comparison:
    low, high = entry["ci95"] or (None, None)
    interval = None if low is None or high is None else (low, high)
    return Comparison(what, entry["unit"], true, entry["value"], interval)


@dataclass(frozen=True, slots=True)
class Judgement:
    """What became of one verdict."""

    outcome: Outcome  # one for the whole verdict
    hidden: tuple[str, ...]  # effects that were there
    named: tuple[str, ...]  # effects that the diagnosis names
    sizes: tuple[Comparison, ...]  # the hidden sizes that can be compared, then the nominal model's parameters


def judge(diagnosis: Json, truth: Json) -> Judgement:
    """Judge the content of diagnosis.json by that of an opened seal."""
    hidden = tuple(name for name in truth["effect"].split("+") if name != NOTHING)
    named = tuple(effect["name"] for effect in diagnosis["effects"])
    return Judgement(
        outcome=_outcome(diagnosis, set(hidden)), hidden=hidden, named=named, sizes=tuple(compare(diagnosis, truth))
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


_COLOURS = {Outcome.RIGHT: "green", Outcome.ABSTAINED: "yellow", Outcome.INCOMPLETE: "yellow"}


def judgement_text(judgement: Judgement, truth: Mapping[str, Any], commitment: str) -> RenderableType:
    """Return what a terminal shows once the seal is open."""
    said = Text(
        f"concealed: {_listed(judgement.hidden)} {_sizes(truth)}\n"
        f"named:     {_listed(judgement.named)}\n"
        f"The seal matches the commitment {commitment[:16]}... made before the rig was driven."
    )
    colour = _COLOURS.get(judgement.outcome, "red")
    title = Text(f" seal opened: {judgement.outcome.value} ", style="bold")
    return Group(Panel(said, title=title, border_style=colour), _table(judgement.sizes))


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "nothing"


def _sizes(truth: Mapping[str, Any]) -> str:
    sizes = [f"{name} = {value:.4g}" for hidden in truth["hidden"].values() for name, value in hidden.items() if value]
    return f"({', '.join(sizes)})" if sizes else ""


def _table(sizes: tuple[Comparison, ...]) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in ("truth against estimate", "unit", "true", "found", "95 % interval", "holds the truth"):
        table.add_column(heading, justify="left" if heading in ("truth against estimate", "unit") else "right")
    for size in sizes:
        interval = "" if size.ci95 is None else f"{size.ci95[0]:.4g} to {size.ci95[1]:.4g}"
        holds = {True: "yes", False: "no", None: ""}[size.inside]
        table.add_row(size.what, size.unit, f"{size.true:.4g}", f"{size.found:.4g}", interval, holds)
    return table
