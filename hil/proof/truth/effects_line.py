"""Hidden effects of motor, shaft and load: how large they are, and what they change in the driveline."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial

import numpy as np

from hil.proof.truth.bus import DURATION_S, Bus
from hil.proof.truth.hidden import (
    ConcealedAt,
    HiddenEffect,
    Sizes,
    draw_absence,
    draw_presence,
    draws,
    either,
    log,
    log_uniform,
    sets,
    then,
    uniform,
)
from hil.proof.truth.laws import TYRE_SHAPE
from hil.proof.truth.physics import ELEMENTS, FloatArray, Physics

FULL_TURN_RAD = 2.0 * np.pi

_load = partial(HiddenEffect, place=ConcealedAt.LOAD)
_motor = partial(HiddenEffect, place=ConcealedAt.MOTOR)
_shaft = partial(HiddenEffect, place=ConcealedAt.SHAFT)

WAVES = 6
SHORTEST_M, LONGEST_M = 40.0, 250.0
"""Wave lengths: shorter is roughness the tyre swallows, longer does not turn within a recording."""

ROAD_LENGTH_M = 20_000.0


def _draw_stribeck(rng: np.random.Generator, bus: Bus) -> Sizes:
    coulomb_nm = log_uniform(rng, 8.0, 25.0)
    return {
        "coulomb_nm": coulomb_nm,
        "breakaway_nm": coulomb_nm * rng.uniform(1.8, 3.0),
        "stribeck_speed_rad_s": log_uniform(rng, 0.8, 4.0),
    }


def _draw_generator(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "inertia_kg_m2": bus.J_M * log_uniform(rng, 0.008, 0.12),
        "lag_before": rng.uniform(0.0, 0.1),
        "clutch_nm": rng.uniform(300.0, 600.0),
        "clutch_rise_s": rng.uniform(0.1, 0.3),
        **draw_absence(rng),
    }


def _couple(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    from_s = rng.uniform(4.0, 15.0)
    return physics._replace(
        generator_inertia=sizes["inertia_kg_m2"],
        generator_lag=sizes["lag_before"],
        clutch_nm=sizes["clutch_nm"],
        clutch_rise_s=sizes["clutch_rise_s"],
        clutch_from_s=from_s,
        clutch_to_s=from_s + rng.uniform(5.0, 13.0),
    )


def _draw_asymmetric(rng: np.random.Generator, bus: Bus) -> Sizes:
    more = either(rng, log_uniform(rng, 0.15, 1.0))
    return {"viscous_forward_nm_s": more, "dry_forward_nm": 5.0 * more}


MOTOR = (
    # Dry friction that is the same at every speed: bearings, seals, an oil pump's preload.
    _motor(
        "coulomb_friction_motor",
        draws(friction_nm=log(8.0, 40.0)),
        sets(friction_motor_nm="friction_nm"),
        fitted={"friction_nm": "friction_nm"},
    ),
    # Dry friction that is higher near standstill than while sliding.
    _motor(
        "stribeck_friction",
        _draw_stribeck,
        sets("stribeck_speed_rad_s", friction_motor_nm="coulomb_nm", breakaway_motor_nm="breakaway_nm"),
        fitted={
            "coulomb_nm": "coulomb_nm",
            "excess_nm": lambda sizes, bus: sizes["breakaway_nm"] - sizes["coulomb_nm"],
            "stribeck_rad_s": "stribeck_speed_rad_s",
        },
    ),
    # A fan, churned oil.
    _motor(
        "quadratic_friction",
        draws(drag_nm_s2=log(0.02, 0.08)),
        sets(quadratic_motor="drag_nm_s2"),
        fitted={"quadratic_nm_s2": "drag_nm_s2"},
    ),
    # The generator runs nearly at the motor's speed beforehand; the closing clutch slips until both are one.
    _motor(
        "generator_coupled",
        _draw_generator,
        _couple,
        when=lambda physics: (physics.clutch_from_s, physics.clutch_to_s),
        fitted={"inertia_kg_m2": "inertia_kg_m2"},
    ),
)


def _draw_nonlinearity(rng: np.random.Generator, bus: Bus) -> Sizes:
    scale_rad = log_uniform(rng, 0.04, 0.15)
    hardens = bool(rng.random() < 0.5)
    return {
        "hardening_twist_rad": scale_rad if hardens else 0.0,
        "softening_twist_rad": 0.0 if hardens else scale_rad,
    }


def _hardening(sizes: Sizes, bus: Mapping[str, float]) -> float:
    """First term of sinh(x) / x and asinh(x) / x beyond 1: x^2 / 6 with either sign."""
    if sizes["hardening_twist_rad"]:
        return 1.0 / (6.0 * sizes["hardening_twist_rad"] ** 2)
    return -1.0 / (6.0 * sizes["softening_twist_rad"] ** 2)


def _draw_step(rng: np.random.Generator, bus: Bus) -> Sizes:
    step = log_uniform(rng, 0.006, 0.08)
    return {
        "stiffness_step": -step if rng.random() < 0.75 else step,
        "rise_s": log_uniform(rng, 0.01, 0.1),
        **draw_presence(rng),
    }


def _slide(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    sliding = sizes["sliding_share"] * physics.k
    return physics._replace(k=physics.k - sliding, hysteresis_stiffness=sliding, hysteresis_slip_rad=sizes["slip_rad"])


def _sliding_friction(sizes: Sizes, bus: Mapping[str, float]) -> float:
    """Torque with all elements sliding: their limits are evenly spaced up to ``slip_rad``."""
    mean_limit = sizes["slip_rad"] * (ELEMENTS + 1) / (2 * ELEMENTS)
    return sizes["sliding_share"] * bus["k"] * mean_limit


def _draw_mode(rng: np.random.Generator, bus: Bus) -> Sizes:
    at_motor = bool(rng.random() < 0.5)
    inertia = bus.J_M * (log_uniform(rng, 0.12, 0.4) if at_motor else log_uniform(rng, 0.4, 2.0))
    stiffness = bus.k * log_uniform(rng, 3.0, 8.0)
    return {
        "at_motor": float(at_motor),
        "inertia_kg_m2": inertia,
        "stiffness_nm_per_rad": stiffness,
        "damping_nm_s_per_rad": 2.0 * rng.uniform(0.01, 0.05) * math.sqrt(inertia * stiffness),
    }


def _draw_viscoelastic(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "maxwell_stiffness_nm_per_rad": bus.k * log_uniform(rng, 0.15, 0.6),
        "maxwell_time_s": log_uniform(rng, 0.01, 0.04),
        "maxwell_fast_share": rng.uniform(0.0, 0.25),
    }


def _draw_gear_losses(rng: np.random.Generator, bus: Bus) -> Sizes:
    efficiency = 1.0 - log_uniform(rng, 0.03, 0.12)
    return {"efficiency": efficiency, "efficiency_back": 1.0 - (1.0 - efficiency) * rng.uniform(1.0, 1.8)}


SHAFT = (
    # Free play in the line: gear teeth, splines, worn joints.
    _shaft("backlash", draws(gap_rad=log(0.004, 0.04)), sets("gap_rad"), fitted={"gap_rad": "gap_rad"}),
    # Hardens or softens with twist; rubber couplings do both.
    _shaft(
        "stiffness_nonlinearity",
        _draw_nonlinearity,
        sets("hardening_twist_rad", "softening_twist_rad"),
        fitted={"hardening_per_rad2": _hardening},
    ),
    # A crack, or a joint that settles: changed from a moment on.
    _shaft(
        "stiffness_change",
        _draw_step,
        then(sets("stiffness_step", stiffness_step_rise_s="rise_s"), "stiffness_step_at_s", 5.0, 25.0),
        when=lambda physics: (physics.stiffness_step_at_s, DURATION_S),
        fitted={"change": "stiffness_step"},
    ),
    # Splines, layered couplings: part of the stiffness slides away with the twist.
    _shaft(
        "shaft_hysteresis",
        draws(sliding_share=log(0.04, 0.25), slip_rad=log(0.01, 0.06)),
        _slide,
        fitted={"friction_nm": _sliding_friction},
    ),
    # The shaft behind a bent joint leads and lags twice per turn; each recording begins at another angle. Its size in
    # the catalogue is the second harmonic of the lead: the square of the tangent of half the bend.
    _shaft(
        "cardan_second_order",
        draws(joint_angle_rad=log(0.08, 0.25)),
        then(sets("joint_angle_rad"), "joint_phase_rad", 0.0, np.pi),
        fitted={"angle_rad": lambda sizes, bus: math.tan(0.5 * sizes["joint_angle_rad"]) ** 2},
    ),
    # A gearbox behind the motor, or an axle before the wheels, on top of the data sheet's inertias: 15 to 50 Hz.
    _shaft(
        "extra_torsional_mode",
        _draw_mode,
        sets(
            extra_at_motor="at_motor",
            extra_inertia="inertia_kg_m2",
            extra_stiffness="stiffness_nm_per_rad",
            extra_damping="damping_nm_s_per_rad",
        ),
    ),
)


def _lay_road(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    road = _height_profile(sizes["slope_rms"], rng)
    return physics._replace(road=road, road_start_m=rng.uniform(0.0, ROAD_LENGTH_M))


def _height_profile(slope_rms: float, rng: np.random.Generator) -> FloatArray:
    """Return waves of equal slope each, shape (WAVES, 3): height [m], wave number [rad/m], phase [rad]."""
    numbers = FULL_TURN_RAD / np.exp(rng.uniform(np.log(SHORTEST_M), np.log(LONGEST_M), WAVES))
    heights = slope_rms * np.sqrt(2.0 / WAVES) / numbers
    return np.column_stack([heights, numbers, rng.uniform(0.0, FULL_TURN_RAD, WAVES)])


def _draw_brake(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"brake_nm": log_uniform(rng, 30.0, 120.0), **draw_absence(rng)}


def _brake(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    from_s = rng.uniform(5.0, 15.0)
    return physics._replace(brake_nm=sizes["brake_nm"], brake_from_s=from_s, brake_to_s=from_s + rng.uniform(5.0, 12.0))


def _slip(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        wheel_inertia=sizes["wheel_inertia_kg_m2"],
        slip_stiffness_nm=sizes["slip_stiffness_nm"],
        grip_nm=sizes["grip_nm"],
        relaxation_rad=sizes["relaxation_m"] / physics.metres_per_rad,
    )


def _draw_imbalance(rng: np.random.Generator, bus: Bus) -> Sizes:
    once_nm = log_uniform(rng, 4.0, 60.0)
    return {"imbalance_nm": once_nm, "imbalance_twice_nm": once_nm * rng.uniform(0.0, 0.3)}


def _draw_payload(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "payload_share": either(rng, log_uniform(rng, 0.06, 0.25)),
        "rise_s": log_uniform(rng, 0.1, 1.0),
        **draw_presence(rng),
    }


LOAD = (
    # Dragging pads, wheel bearings, axle seals.
    _load(
        "coulomb_friction_load",
        draws(friction_nm=log(7.0, 35.0)),
        sets(friction_load_nm="friction_nm"),
        fitted={"friction_nm": "friction_nm"},
    ),
    # Air drag, with a head wind or a roof load.
    _load(
        "aerodynamic_drag",
        draws(drag_nm_s2=log(0.02, 0.08)),
        sets(quadratic_load="drag_nm_s2"),
        fitted={"drag_nm_s2": "drag_nm_s2"},
    ),
    # The road's height over the distance driven, as a sum of waves; gravity does the rest.
    _load("road_grade", draws(slope_rms=log(0.003, 0.01)), _lay_road),
    # Drags for some seconds in the middle of a recording.
    _load(
        "brake_drag",
        _draw_brake,
        _brake,
        when=lambda physics: (physics.brake_from_s, physics.brake_to_s),
        fitted={"brake_nm": "brake_nm"},
    ),
    # Only the wheels turn with the shaft, the vehicle follows through the contact patch. The catalogue's G tanh(x / G)
    # levels off as D sin(C atan(x / (C D))) does where their terms in x^3 agree.
    _load(
        "tyre_slip",
        draws(
            wheel_inertia_kg_m2=uniform(1.5, 5.0),
            slip_stiffness_nm=log(4e4, 3e5),
            grip_nm=log(1500.0, 6000.0),
            relaxation_m=uniform(0.15, 0.5),
        ),
        _slip,
        fitted={
            "slip_per_nm": lambda sizes, bus: 1.0 / sizes["slip_stiffness_nm"],
            "wheel_share": lambda sizes, bus: sizes["wheel_inertia_kg_m2"] / bus["J_L"],
            "relaxation_rad": lambda sizes, bus: sizes["relaxation_m"] * bus["gear_ratio"] / bus["wheel_radius_m"],
            "grip_nm": lambda sizes, bus: sizes["grip_nm"] / math.sqrt(0.5 + TYRE_SHAPE**-2),
        },
    ),
    # A heavy or an oval wheel, once and twice per wheel turn; each recording begins at another angle.
    _load(
        "load_imbalance",
        _draw_imbalance,
        then(sets("imbalance_nm", "imbalance_twice_nm"), "imbalance_phase_rad", 0.0, FULL_TURN_RAD),
        fitted={"amplitude_nm": "imbalance_nm"},
    ),
    # Sand or water runs out, or comes from a vehicle alongside, at the bus's speed: the speed continues without a step
    # and the constant load torque stays.
    _load(
        "inertia_change",
        _draw_payload,
        then(sets("payload_share", payload_rise_s="rise_s"), "payload_at_s", 6.0, 22.0),
        when=lambda physics: (physics.payload_at_s, DURATION_S),
        fitted={"change_kg_m2": lambda sizes, bus: sizes["payload_share"] * bus["J_L"]},
    ),
    # Axle oil that is thick when cold; every recording begins cold.
    _load(
        "warming_friction",
        draws(cold_factor=lambda rng: 1.0 + log_uniform(rng, 0.12, 1.5), warming_time_s=log(4.0, 15.0)),
        sets("cold_factor", "warming_time_s"),
    ),
)

FURTHER = (
    # A shorted turn: greatest at one speed. Currents keep to the surface at speed (Davies, 1963).
    _motor(
        "eddy_drag",
        draws(eddy_nm=log(10.0, 60.0), eddy_speed_rad_s=log(8.0, 25.0), eddy_exponent=uniform(0.88, 1.0)),
        sets("eddy_nm", "eddy_speed_rad_s", "eddy_exponent"),
        fitted={"peak_nm": "eddy_nm", "peak_rad_s": "eddy_speed_rad_s"},
    ),
    # Rubber adds branches that relax, one slow and a smaller one fast (a Prony series).
    _shaft(
        "viscoelastic_shaft",
        _draw_viscoelastic,
        sets("maxwell_time_s", "maxwell_fast_share", maxwell_stiffness="maxwell_stiffness_nm_per_rad"),
    ),
    # A helical gear that runs up against its seal: its dry part differs as well as its viscous one.
    _motor(
        "asymmetric_friction",
        _draw_asymmetric,
        sets("dry_forward_nm", viscous_forward="viscous_forward_nm_s"),
        fitted={"difference_nm_s": "viscous_forward_nm_s"},
    ),
    # A share of the power transmitted, and more of it when the load drives them.
    _shaft(
        "gear_losses",
        _draw_gear_losses,
        sets("efficiency", "efficiency_back"),
        fitted={"driving_share": lambda sizes, bus: 1.0 - sizes["efficiency"]},
    ),
)
"""What the catalogue got later: the order of all effects is what seeds count by."""
