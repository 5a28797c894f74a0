"""Sizes of a verdict against the truth's: what a hidden effect's file says its fitted parameters should be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hil.proof.truth.specimen import EFFECTS

Json = Mapping[str, Any]


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
