"""True sizes that a fitted law has too: which of its parameters means the same, and how to get from one to the other.

What has no line here has no counterpart: the truth's formulation is another one (``hil.proof.truth``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from hil.proof.judge import Comparison
from hil.proof.truth.iwan import ELEMENTS
from hil.proof.truth.tyre import SHAPE

Json = Mapping[str, Any]

Convert = Callable[[Json, Json], float | None]
"""Sizes of the effect and true bus to the value the fitted parameter should have; None where it has none."""


def _same(name: str) -> Convert:
    return lambda sizes, bus: float(sizes[name])


def _unless_zero(name: str) -> Convert:
    """Of an effect that comes in variants: the size is 0 where another was drawn."""
    return lambda sizes, bus: float(sizes[name]) or None


def _derating_depth(sizes: Json, bus: Json) -> float | None:
    """Only the exponential loss has one: the even one ends nowhere."""
    return float(sizes["loss"]) if sizes["time_constant_s"] else None


def _excess(sizes: Json, bus: Json) -> float:
    return float(sizes["breakaway_nm"] - sizes["coulomb_nm"])


def _hardening(sizes: Json, bus: Json) -> float:
    """First term of sinh(x) / x and asinh(x) / x beyond 1: x^2 / 6 with either sign."""
    if sizes["hardening_twist_rad"]:
        return 1.0 / (6.0 * float(sizes["hardening_twist_rad"]) ** 2)
    return -1.0 / (6.0 * float(sizes["softening_twist_rad"]) ** 2)


def _sliding_nm(sizes: Json, bus: Json) -> float:
    """Torque with all elements sliding: their limits are evenly spaced up to ``slip_rad``."""
    mean_limit = sizes["slip_rad"] * (ELEMENTS + 1) / (2 * ELEMENTS)
    return float(sizes["sliding_share"] * bus["k"] * mean_limit)


def _lead_rad(sizes: Json, bus: Json) -> float:
    """Second harmonic of a Cardan joint's lead: the square of the tangent of half its bend."""
    return math.tan(0.5 * sizes["joint_angle_rad"]) ** 2


def _slip_per_nm(sizes: Json, bus: Json) -> float:
    return 1.0 / float(sizes["slip_stiffness_nm"])


def _wheel_share(sizes: Json, bus: Json) -> float:
    return float(sizes["wheel_inertia_kg_m2"] / bus["J_L"])


def _relaxation_rad(sizes: Json, bus: Json) -> float:
    return float(sizes["relaxation_m"] * bus["gear_ratio"] / bus["wheel_radius_m"])


def _grip_nm(sizes: Json, bus: Json) -> float:
    """Grip of the ``G tanh(x / G)`` that levels off as ``D sin(C atan(x / (C D)))`` does: their terms in x^3 agree."""
    return float(sizes["grip_nm"]) / math.sqrt(0.5 + SHAPE**-2)


def _payload(sizes: Json, bus: Json) -> float:
    return float(sizes["payload_share"] * bus["J_L"])


def _speed_step(sizes: Json, bus: Json) -> float:
    if sizes["grid_rad_s"]:
        return float(sizes["grid_rad_s"])
    return float(sizes["count_rad"] / sizes["count_time_s"])


def _beat(sizes: Json, bus: Json) -> float | None:
    """Share of repeats in a beat; of random ones each recording has its own."""
    return 1.0 / float(sizes["every"]) if sizes["every"] else None


def _jitter_rms(sizes: Json, bus: Json) -> float:
    """Root mean square of a uniform deviation over its greatest: 1 / sqrt(3)."""
    return float(sizes["jitter_s"]) / math.sqrt(3.0)


def _lost_driving(sizes: Json, bus: Json) -> float:
    return 1.0 - float(sizes["efficiency"])


COUNTERPARTS: Mapping[str, Mapping[str, Convert]] = {
    "inverter_gain_mismatch": {"gain_m1": _same("gain_m1")},
    "torque_derating": {"depth": _derating_depth, "time_constant_s": _unless_zero("time_constant_s")},
    "torque_saturation": {
        "limit_m1_nm": _unless_zero("limit_m1_nm"),
        "limit_m2_nm": _unless_zero("limit_m2_nm"),
        "limit_sum_nm": _unless_zero("limit_total_nm"),
    },
    "actuator_lag": {"time_constant_s": _same("current_loop_time_s")},
    "transport_delay": {"delay_s": _same("delay_s")},
    "torque_ripple": {
        "order": _same("order"),
        "amplitude_nm": _unless_zero("ripple_nm"),
        "share": _unless_zero("ripple_over_torque"),
    },
    "coulomb_friction_motor": {"friction_nm": _same("coulomb_nm")},
    "stribeck_friction": {
        "coulomb_nm": _same("coulomb_nm"),
        "excess_nm": _excess,
        "stribeck_rad_s": _same("stribeck_speed_rad_s"),
    },
    "quadratic_friction": {"quadratic_nm_s2": _same("drag_nm_s2")},
    "generator_coupled": {"inertia_kg_m2": _same("inertia_kg_m2")},
    "backlash": {"gap_rad": _same("gap_rad")},
    "stiffness_nonlinearity": {"hardening_per_rad2": _hardening},
    "stiffness_change": {"change": _same("stiffness_step")},
    "shaft_hysteresis": {"friction_nm": _sliding_nm},
    "cardan_second_order": {"angle_rad": _lead_rad},
    "coulomb_friction_load": {"friction_nm": _same("coulomb_nm")},
    "aerodynamic_drag": {"drag_nm_s2": _same("drag_nm_s2")},
    "brake_drag": {"brake_nm": _same("brake_nm")},
    "tyre_slip": {
        "slip_per_nm": _slip_per_nm,
        "wheel_share": _wheel_share,
        "relaxation_rad": _relaxation_rad,
        "grip_nm": _grip_nm,
    },
    "load_imbalance": {"amplitude_nm": _same("imbalance_nm")},
    "inertia_change": {"change_kg_m2": _payload},
    "resolver_error": {"once_rad": _same("resolver_once_rad"), "twice_rad": _same("resolver_twice_rad")},
    "speed_filter": {"time_constant_s": _unless_zero("time_constant_s")},
    "speed_quantisation": {"step_rad_s": _speed_step},
    "stale_samples": {"share": _beat},
    "sample_jitter": {"jitter_s": _jitter_rms},
    "clock_drift": {"rate": _same("clock_error")},
    "eddy_drag": {"peak_nm": _same("eddy_nm"), "peak_rad_s": _same("eddy_speed_rad_s")},
    "asymmetric_friction": {"difference_nm_s": _same("viscous_forward_nm_s")},
    "gear_losses": {"driving_share": _lost_driving},
}
"""Effect to fitted parameter to what it should be."""


def compare(diagnosis: Json, truth: Json) -> list[Comparison]:
    """Hold every size of a hidden effect that was named, and every nominal parameter, against the truth."""
    found = {effect["name"]: effect["parameters"] for effect in diagnosis["effects"]}
    sizes = [
        _comparison(f"{effect}: {name}", true, found[effect][name])
        for effect, hidden in truth["hidden"].items()
        for name, convert in COUNTERPARTS.get(effect, {}).items()
        if _is_given(found.get(effect, {}), name) and (true := convert(hidden, truth["true"])) is not None
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
