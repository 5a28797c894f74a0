"""Every effect that can be concealed, by name."""

from __future__ import annotations

from importlib import import_module

from hil.errors import UsageError
from hil.proof.truth.hidden import HiddenEffect

_FILES = (
    "none",
    "inverter_gain_mismatch",
    "torque_derating",
    "torque_saturation",
    "actuator_lag",
    "transport_delay",
    "torque_ripple",
    "coulomb_friction_motor",
    "stribeck_friction",
    "quadratic_friction",
    "generator_coupled",
    "backlash",
    "stiffness_nonlinearity",
    "stiffness_change",
    "shaft_hysteresis",
    "cardan_second_order",
    "extra_torsional_mode",
    "coulomb_friction_load",
    "aerodynamic_drag",
    "road_grade",
    "brake_drag",
    "tyre_slip",
    "load_imbalance",
    "inertia_change",
    "warming_friction",
    "resolver_error",
    "speed_filter",
    "speed_sign_blind",
    "speed_quantisation",
    "stale_samples",
    "lost_samples",
    "sample_jitter",
    "clock_drift",
    "eddy_drag",
    "viscoelastic_shaft",
    "asymmetric_friction",
    "gear_losses",
    "torque_nonlinearity",
    "torque_bias",
    "torque_deadband",
    "torque_slew",
    "torque_dropouts",
    "inertia_by_speed",
    "speed_stiffened_shaft",
    "corrugated_road",
    "sensor_curvature",
    "speed_spikes",
)
"""Nothing; the contract's catalogue in its order; what no entry of it describes. Each is a file in ``effects``."""


def _effect(file: str) -> HiddenEffect:
    effect: HiddenEffect = import_module(f"hil.proof.truth.effects.{file}").EFFECT
    return effect


EFFECTS: dict[str, HiddenEffect] = {effect.name: effect for effect in map(_effect, _FILES)}

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
