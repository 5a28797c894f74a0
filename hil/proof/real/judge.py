"""What was found, held against what is known; the only part that reads ``truth.toml``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hil.proof.real.truth_file import Goal, KnownValue


@dataclass(frozen=True, slots=True)
class Agreement:
    """One known thing besides what was found.

    Attributes
    ----------
    found, ci95
        None where the verdict does not have it.
    inside
        Whether the 95 % interval holds the known value; None where there is no interval.
    within
        Whether it agrees as closely as the truth file asks.
    asked
        What that is, in words.
    """

    what: str
    unit: str
    truth: float
    found: float | None
    ci95: tuple[float, float] | None
    inside: bool | None
    within: bool
    asked: str


def value_agreement(known: KnownValue, diagnosis: Mapping[str, Any]) -> Agreement:
    """Hold one known quantity against a diagnosis."""
    entry = _entry(diagnosis, known.found)
    asked = f"within {known.within:.0%} of {known.value:g} {known.unit}"
    if entry is None or entry["value"] is None:
        return Agreement(known.what, known.unit, known.value, None, None, None, False, asked)
    found, (low, high) = float(entry["value"]), entry["ci95"]
    within = abs(found - known.value) <= known.within * abs(known.value)
    if low is None or high is None:
        return Agreement(known.what, known.unit, known.value, found, None, None, within, asked)
    return Agreement(known.what, known.unit, known.value, found, (low, high), low <= known.value <= high, within, asked)


def _entry(diagnosis: Mapping[str, Any], place: str) -> Mapping[str, Any] | None:
    """Return the value and interval at a dotted place of ``diagnosis.json``."""
    match place.split("."):
        case ["parameters", name]:
            return _table(diagnosis["parameters"].get(name))
        case ["effects", effect, name]:
            found = [entry for entry in diagnosis["effects"] if entry["name"] == effect]
            return _table(found[0]["parameters"].get(name)) if found else None
        case ["load_torque"]:
            loads = list(diagnosis["load_torque"].values())
            return _table(loads[0]) if len(loads) == 1 else None
    raise ValueError(f"expected parameters.NAME, effects.NAME.NAME or load_torque, got {place}")


def _table(value: Any) -> Mapping[str, Any] | None:
    return value if isinstance(value, dict) else None


def goal_agreement(goal: Goal, errors: Mapping[str, float], unit: str) -> Agreement:
    """Hold the errors of the augmented model, by recording, against a goal: their median counts."""
    counted = [error for name, error in errors.items() if not goal.recordings or name in goal.recordings]
    asked = f"at most {goal.at_most:g} {unit}".rstrip()
    if not counted:
        return Agreement(goal.what, unit, goal.at_most, None, None, None, False, asked)
    found = float(np.median(counted))
    return Agreement(goal.what, unit, goal.at_most, found, None, None, found <= goal.at_most, asked)


def median_agreement(what: str, unit: str, values: Sequence[float | None], at_least: float) -> Agreement:
    """Hold the median of several runs' values against what it should at least be; one without a value counts as 0."""
    asked = f"median at least {at_least:g}"
    if not any(value is not None for value in values):
        return Agreement(what, unit, at_least, None, None, None, False, asked)
    found = float(np.median([0.0 if value is None else value for value in values]))
    return Agreement(what, unit, at_least, found, None, None, found >= at_least, asked)
