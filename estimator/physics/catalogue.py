"""The catalogue: every effect the superset model holds. A new one is a file in ``effects/`` and a line here."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from estimator.physics.driveline import EffectValue, Structure
from estimator.physics.effect import Effect
from estimator.physics.effects import (
    actuator_lag,
    aerodynamic_drag,
    asymmetric_friction,
    backlash,
    brake_drag,
    cardan_second_order,
    clock_drift,
    coulomb_friction_load,
    coulomb_friction_motor,
    eddy_drag,
    extra_torsional_mode,
    gear_losses,
    generator_coupled,
    gravity,
    grounded_spring,
    inertia_change,
    inverter_gain_mismatch,
    load_imbalance,
    lost_samples,
    quadratic_friction,
    resolver_error,
    road_grade,
    sample_jitter,
    shaft_hysteresis,
    speed_filter,
    speed_quantisation,
    speed_sign_blind,
    stale_samples,
    stiffness_change,
    stiffness_nonlinearity,
    stribeck_friction,
    torque_bias,
    torque_derating,
    torque_nonlinearity,
    torque_ripple,
    torque_saturation,
    transport_delay,
    tyre_slip,
    viscoelastic_shaft,
    warming_friction,
)
from estimator.physics.own_law import LawName

_ENTRIES = (
    inverter_gain_mismatch.EFFECT,
    torque_derating.EFFECT,
    torque_saturation.EFFECT,
    torque_nonlinearity.EFFECT,
    torque_bias.EFFECT,
    actuator_lag.EFFECT,
    transport_delay.EFFECT,
    torque_ripple.EFFECT,
    coulomb_friction_motor.EFFECT,
    stribeck_friction.EFFECT,
    quadratic_friction.EFFECT,
    eddy_drag.EFFECT,
    asymmetric_friction.EFFECT,
    generator_coupled.EFFECT,
    backlash.EFFECT,
    stiffness_nonlinearity.EFFECT,
    stiffness_change.EFFECT,
    shaft_hysteresis.EFFECT,
    viscoelastic_shaft.EFFECT,
    gear_losses.EFFECT,
    cardan_second_order.EFFECT,
    extra_torsional_mode.EFFECT,
    coulomb_friction_load.EFFECT,
    aerodynamic_drag.EFFECT,
    road_grade.EFFECT,
    brake_drag.EFFECT,
    tyre_slip.EFFECT,
    load_imbalance.EFFECT,
    gravity.EFFECT,
    grounded_spring.EFFECT,
    inertia_change.EFFECT,
    warming_friction.EFFECT,
    resolver_error.EFFECT,
    speed_filter.EFFECT,
    speed_sign_blind.EFFECT,
    speed_quantisation.EFFECT,
    stale_samples.EFFECT,
    lost_samples.EFFECT,
    sample_jitter.EFFECT,
    clock_drift.EFFECT,
)


def _mutual(entries: Sequence[Effect]) -> dict[str, Effect]:
    """Return the entries by name; what one resembles, or is equivalent to, resembles it or is equivalent to it."""

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


class _Effects(Mapping[str, Effect]):
    """The catalogue, in which the name of a user's own law finds its law, too."""

    def __getitem__(self, name: str) -> Effect:
        return name.entry if isinstance(name, LawName) else BUILT_IN[name]

    def __iter__(self) -> Iterator[str]:
        return iter(BUILT_IN)

    def __len__(self) -> int:
        return len(BUILT_IN)


EFFECTS: Mapping[str, Effect] = _Effects()
"""Name to entry, along the chain from torque command to load."""


def effect_problems(
    name: str, values: Mapping[str, EffectValue], structure: Structure, laws: Sequence[LawName]
) -> list[str]:
    """Return what is wrong with an effect of a model that has these laws of its own, one line per fault."""
    entry = EFFECTS.get(name)
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
    return problems + _limit_problems(entry, values)


def _limit_problems(entry: Effect, values: Mapping[str, EffectValue]) -> list[str]:
    """Refuse values that no line has: a negative delay would read the future, a share is no more than the whole."""
    problems = []
    for parameter in entry.parameters:
        value = values[parameter.name].value if parameter.name in values else parameter.null
        least = "greater than 0" if parameter.low > 0 and parameter.null > 0 else "0 or greater"
        allowed = least if math.isinf(parameter.most) else f"{least}, up to {parameter.most:g}"
        too_small = value < 0 <= parameter.low or (value == 0 and least == "greater than 0")
        if too_small or value > parameter.most:
            problems.append(f"effects.{entry.name}.{parameter.name}.value: expected a number {allowed}, got {value}")
    return problems
