"""The catalogue: every effect the superset model holds. A new one is a file in ``effects/`` and a line here."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from estimator.physics.driveline import EffectValue, Structure
from estimator.physics.effect import MOMENTS, Effect
from estimator.physics.effects import drag, dry_friction, inertia, load, periodic, sensor, shaft, timing, torque
from estimator.physics.own_law import LawName
from estimator.physics.tables import PREFIX, TABLES, table_faults, table_of

_ENTRIES = (
    torque.INVERTER_GAIN_MISMATCH,
    torque.TORQUE_DERATING,
    torque.TORQUE_SATURATION,
    torque.TORQUE_NONLINEARITY,
    torque.TORQUE_BIAS,
    timing.ACTUATOR_LAG,
    timing.TRANSPORT_DELAY,
    periodic.TORQUE_RIPPLE,
    dry_friction.COULOMB_FRICTION_MOTOR,
    dry_friction.STRIBECK_FRICTION,
    drag.QUADRATIC_FRICTION,
    drag.EDDY_DRAG,
    drag.ASYMMETRIC_FRICTION,
    inertia.GENERATOR_COUPLED,
    shaft.BACKLASH,
    shaft.STIFFNESS_NONLINEARITY,
    shaft.STIFFNESS_CHANGE,
    shaft.SHAFT_HYSTERESIS,
    shaft.VISCOELASTIC_SHAFT,
    drag.GEAR_LOSSES,
    periodic.CARDAN_SECOND_ORDER,
    inertia.EXTRA_TORSIONAL_MODE,
    dry_friction.COULOMB_FRICTION_LOAD,
    drag.AERODYNAMIC_DRAG,
    load.ROAD_GRADE,
    dry_friction.BRAKE_DRAG,
    load.TYRE_SLIP,
    periodic.LOAD_IMBALANCE,
    load.GRAVITY,
    load.GROUNDED_SPRING,
    inertia.INERTIA_CHANGE,
    drag.WARMING_FRICTION,
    sensor.RESOLVER_ERROR,
    timing.SPEED_FILTER,
    sensor.SPEED_SIGN_BLIND,
    sensor.SPEED_QUANTISATION,
    sensor.STALE_SAMPLES,
    sensor.LOST_SAMPLES,
    sensor.SAMPLE_JITTER,
    timing.CLOCK_DRIFT,
)


def _mutual(entries: Sequence[Effect]) -> dict[str, Effect]:

    def of(entry: Effect, names: Callable[[Effect], tuple[str, ...]]) -> tuple[str, ...]:
        return tuple(dict.fromkeys([*names(entry), *(each.name for each in entries if entry.name in names(each))]))

    return {
        entry.name: replace(
            entry,
            resembles=of(entry, lambda each: each.resembles),
            equivalent=of(entry, lambda each: each.equivalent),
        )
        for entry in entries
    }


BUILT_IN: Mapping[str, Effect] = MappingProxyType(_mutual(_ENTRIES))
"""The entries that the kernel has."""


KERNEL: Mapping[str, Effect] = MappingProxyType({**BUILT_IN, **TABLES})
"""All that the kernel has a place for: the catalogue, and the laws without a name."""


class _Effects(Mapping[str, Effect]):
    """The catalogue, in which the names of a user's own law and of a table find their law, too."""

    def __getitem__(self, name: str) -> Effect:
        return name.entry if isinstance(name, LawName) else KERNEL[name]

    def __iter__(self) -> Iterator[str]:
        return iter(BUILT_IN)

    def __len__(self) -> int:
        return len(BUILT_IN)


EFFECTS: Mapping[str, Effect] = _Effects()
"""Name to entry, along the chain from torque command to load."""


def title_of(name: str) -> str:
    """Return an effect's title, for sentences; of a name that is in no catalogue its words."""
    return EFFECTS[name].title if name in EFFECTS else name.replace("_", " ")


def effect_problems(
    name: str, values: Mapping[str, EffectValue], structure: Structure, laws: Sequence[LawName]
) -> list[str]:
    """Return what is wrong with an effect of a model that has these laws of its own, one line per fault."""
    entry = EFFECTS.get(name)
    if name in TABLES:
        return _table_problems(name, values, structure)
    if entry is None:
        return [f"effects.{name}: unknown effect, expected one of {', '.join([*EFFECTS, *laws])}"]
    problems = []
    if structure not in entry.structures:
        fits = ", ".join(sorted(each.value for each in entry.structures))
        problems.append(f"effects.{name}: makes no sense in {structure.value}, expected {fits}")
    expected = [parameter.name for parameter in entry.parameters]
    listed = ", ".join(expected)
    required = [parameter.name for parameter in entry.parameters if not parameter.optional]
    problems += [f"effects.{name}.{key}: missing, expected {listed}" for key in required if key not in values]
    problems += [f"effects.{name}.{key}: unknown parameter, expected {listed}" for key in values if key not in expected]
    problems += [
        f"effects.{name}.{key}.value: expected a finite number, got {entry_value.value}"
        for key, entry_value in values.items()
        if not math.isfinite(entry_value.value)
    ]
    problems += [
        f"effects.{name}.{key}.tolerance: expected a relative tolerance from 0 up to 1, got {entry_value.tolerance}"
        for key, entry_value in values.items()
        if not 0 <= entry_value.tolerance < 1
    ]
    problems += [
        f"effects.{name}.{key}.tolerance: expected none for a value of 0, of which every share is 0, got "
        f"{entry_value.tolerance}: leave it out to hold the value, or leave out the effect to have it looked for"
        for key, entry_value in values.items()
        if entry_value.tolerance > 0 and entry_value.value == 0
    ]
    problems += [
        f"effects.{name}.{key}.ci95: expected two numbers, the lower one first, got {list(entry_value.ci95)}"
        for key, entry_value in values.items()
        if entry_value.ci95 is not None and not entry_value.ci95[0] <= entry_value.ci95[1]
    ]
    return problems + _limit_problems(entry, values)


def _limit_problems(entry: Effect, values: Mapping[str, EffectValue]) -> list[str]:
    """Refuse values that no line has: a negative delay would read the future, a share is no more than the whole."""
    problems = []
    for parameter in entry.parameters:
        value = values[parameter.name].value if parameter.name in values else parameter.null
        low = 0.0 if parameter.low >= 0 else parameter.least
        is_open = parameter.low > 0 and parameter.null > 0
        least = "greater than 0" if is_open else f"{low:g} or greater"
        allowed = least if math.isinf(parameter.most) else f"{least}, up to {parameter.most:g}"
        if value < low or (is_open and value == 0) or value > parameter.most:
            problems.append(f"effects.{entry.name}.{parameter.name}.value: expected a number {allowed}, got {value}")
    return problems + (_moment_problems(entry, values) if entry.event else [])


def _moment_problems(entry: Effect, values: Mapping[str, EffectValue]) -> list[str]:
    """Refuse an event that ends before it begins, or of which only the beginning is given."""
    begin, end = (each.name for each in MOMENTS)
    begins = values[begin].value if begin in values else 0.0
    ends = values[end].value if end in values else 0.0
    if not 0.0 <= ends < begins:  # a negative moment is refused as such
        return []
    got = f"got {ends}" if end in values else "which is missing"
    return [
        f"effects.{entry.name}.{end}.value: expected a moment that is not before {begin} = {begins}, when it begins, "
        f"{got}"
    ]


def _table_problems(name: str, values: Mapping[str, EffectValue], structure: Structure) -> list[str]:
    where, entry = f"tables.{name.removeprefix(PREFIX)}", TABLES[name]
    problems = []
    if structure not in entry.structures:
        fits = ", ".join(sorted(each.value for each in entry.structures))
        problems.append(f"{where}: makes no sense in {structure.value}, expected {fits}")
    faults = table_faults(table_of(name, values))
    return problems + [f"{where}.{key}: expected {expected}, got {got}" for key, expected, got in faults]
