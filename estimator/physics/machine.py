"""What a person knows of a machine beyond its line: which parts it has, and how usual an effect is in it.

A part that a machine has not can do nothing: the effects that only it has are no candidates then.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from estimator.physics.effect import Effect
from estimator.signals.record import OutputKind, Record

PARTS: Final[Mapping[str, frozenset[str]]] = MappingProxyType(
    {
        "brake": frozenset({"brake_drag"}),
        "clutch": frozenset({"generator_coupled"}),
        "payload": frozenset({"inertia_change"}),
        "tyre": frozenset({"tyre_slip"}),
        "resolver": frozenset({"resolver_error"}),
    }
)
"""Parts that a machine may have, by their names in ``[machine] has``, and the effects that only they have."""

VEHICLE: Final = frozenset({"brake", "clutch", "tyre"})
SECOND_MOTOR: Final = frozenset({"clutch"})
OF_TWO_INVERTERS: Final = frozenset({"inverter_gain_mismatch"})


def parts_of(has: Collection[str] | None, records: Sequence[Record]) -> frozenset[str]:
    """Return the parts of a machine: those that its model names, or else what its recordings imply.

    A measured position is that of an axis, which has neither a vehicle's brake, clutch and tyres nor a resolver that
    speed is read from. The clutch of a line is the one to a second motor: with one torque input there is none.
    """
    if has is not None:
        return frozenset(has)
    absent: frozenset[str] = frozenset()
    if any(record.kind is OutputKind.POSITION for record in records):
        absent |= VEHICLE | {"resolver"}
    if _one_input(records):
        absent |= SECOND_MOTOR
    return frozenset(PARTS) - absent


def out_of_question(has: Collection[str] | None, records: Sequence[Record]) -> frozenset[str]:
    """Return the effects that a machine with these parts can't have, of which there is nothing to test."""
    parts = parts_of(has, records)
    absent = frozenset[str]().union(*(effects for part, effects in PARTS.items() if part not in parts))
    return absent | OF_TWO_INVERTERS if _one_input(records) else absent


def _one_input(records: Sequence[Record]) -> bool:
    return all(record.torque_nm.shape[1] < 2 for record in records)


def part_problems(has: Collection[str] | None, effects: Collection[str]) -> list[str]:
    """Return what is wrong with ``[machine] has`` in a model with some effects."""
    if has is None:
        return []
    unknown = [
        f"machine.has: expected parts among {', '.join(PARTS)}, got {part!r}" for part in has if part not in PARTS
    ]
    lacking = [
        f"machine.has: expected {part!r} in it, since the model has effects.{name}, got none"
        for part, only_it in PARTS.items()
        for name in only_it
        if name in effects and part not in has
    ]
    return [*unknown, *lacking]


@dataclass(frozen=True, slots=True)
class Prior:
    """What a person knows of an effect before any recording is seen.

    Attributes
    ----------
    odds : float or None
        Odds that the machine has it, p / (1 - p); None: as usual.
    sizes : mapping of parameter name to (low, high)
        Where its parameters lie, with 95 % probability, in their units.
    """

    odds: float | None = None
    sizes: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def prior_problems(entry: Effect, prior: Prior) -> list[str]:
    """Return what is wrong with the prior of an effect, one line per fault."""
    problems = []
    if prior.odds is not None and not (math.isfinite(prior.odds) and prior.odds > 0.0):
        problems.append(f".odds: expected odds above 0, such as 0.5 for one in three, got {prior.odds}")
    known = {parameter.name: parameter for parameter in entry.parameters if not parameter.own}
    for name, (low, high) in prior.sizes.items():
        if name not in known:
            problems.append(f".{name}: unknown parameter, expected odds or one of {', '.join(known)}")
        elif not (math.isfinite(low) and math.isfinite(high) and low < high):
            problems.append(f".{name}: expected two numbers, the lower first, got {[low, high]}")
        elif (low < 0.0 <= known[name].low) or high > known[name].most:
            most = "" if math.isinf(known[name].most) else f", up to {known[name].most:g}"
            problems.append(f".{name}: expected sizes of 0 or greater{most}, got {[low, high]}")
    if prior.odds is None and not prior.sizes:
        problems.append(": expected odds or the range of a parameter, got neither")
    return [f"priors.{entry.name}{problem}" for problem in problems]
