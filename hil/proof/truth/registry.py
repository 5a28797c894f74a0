"""Every effect that can be concealed, by name."""

from __future__ import annotations

from hil.errors import UsageError
from hil.proof.truth.effects import (
    actuator_lag,
    aerodynamic_drag,
    asymmetric_friction,
    backlash,
    brake_drag,
    cardan_second_order,
    clock_drift,
    corrugated_road,
    coulomb_friction_load,
    coulomb_friction_motor,
    eddy_drag,
    extra_torsional_mode,
    gear_losses,
    generator_coupled,
    inertia_by_speed,
    inertia_change,
    inverter_gain_mismatch,
    load_imbalance,
    lost_samples,
    none,
    quadratic_friction,
    resolver_error,
    road_grade,
    sample_jitter,
    sensor_curvature,
    shaft_hysteresis,
    speed_filter,
    speed_quantisation,
    speed_sign_blind,
    speed_spikes,
    speed_stiffened_shaft,
    stale_samples,
    stiffness_change,
    stiffness_nonlinearity,
    stribeck_friction,
    torque_bias,
    torque_deadband,
    torque_derating,
    torque_dropouts,
    torque_nonlinearity,
    torque_ripple,
    torque_saturation,
    torque_slew,
    transport_delay,
    tyre_slip,
    viscoelastic_shaft,
    warming_friction,
)
from hil.proof.truth.hidden import HiddenEffect

_MODULES = (
    none,
    inverter_gain_mismatch,
    torque_derating,
    torque_saturation,
    actuator_lag,
    transport_delay,
    torque_ripple,
    coulomb_friction_motor,
    stribeck_friction,
    quadratic_friction,
    generator_coupled,
    backlash,
    stiffness_nonlinearity,
    stiffness_change,
    shaft_hysteresis,
    cardan_second_order,
    extra_torsional_mode,
    coulomb_friction_load,
    aerodynamic_drag,
    road_grade,
    brake_drag,
    tyre_slip,
    load_imbalance,
    inertia_change,
    warming_friction,
    resolver_error,
    speed_filter,
    speed_sign_blind,
    speed_quantisation,
    stale_samples,
    lost_samples,
    sample_jitter,
    clock_drift,
    eddy_drag,
    viscoelastic_shaft,
    asymmetric_friction,
    gear_losses,
    torque_nonlinearity,
    torque_bias,
    torque_deadband,
    torque_slew,
    torque_dropouts,
    inertia_by_speed,
    speed_stiffened_shaft,
    corrugated_road,
    sensor_curvature,
    speed_spikes,
)
"""Nothing; the contract's catalogue in its order; what no entry of it describes."""

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
