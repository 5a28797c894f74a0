"""Every effect that can be concealed, by name."""

from __future__ import annotations

from hil.errors import UsageError
from hil.proof.truth.effects import (
    actuator_lag,
    aerodynamic_drag,
    backlash,
    brake_drag,
    coulomb_friction_motor,
    inverter_gain_mismatch,
    maxwell_shaft,
    none,
    quadratic_friction,
    resolver_error,
    road_grade,
    stiffness_nonlinearity,
    stribeck_friction,
    transport_delay,
)
from hil.proof.truth.hidden import HiddenEffect

_MODULES = (
    none,
    coulomb_friction_motor,
    stribeck_friction,
    backlash,
    stiffness_nonlinearity,
    actuator_lag,
    transport_delay,
    road_grade,
    brake_drag,
    quadratic_friction,
    aerodynamic_drag,
    resolver_error,
    inverter_gain_mismatch,
    maxwell_shaft,
)

EFFECTS: dict[str, HiddenEffect] = {module.EFFECT.name: module.EFFECT for module in _MODULES}

PAIR_SIGN = "+"


def find(names: str) -> tuple[HiddenEffect, ...]:
    """Return the effects of a name or of several joined by ``+`` (``backlash+road_grade``).

    Raises
    ------
    UsageError
        If one of them is not registered.
    """
    wanted = names.split(PAIR_SIGN)
    for name in wanted:
        if name not in EFFECTS:
            raise UsageError(
                f"effect {name!r}: expected one of {', '.join(EFFECTS)}, or several joined by {PAIR_SIGN!r}"
            )
    return tuple(EFFECTS[name] for name in wanted)
