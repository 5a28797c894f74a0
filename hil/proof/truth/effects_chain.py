"""Hidden effects from the torque path to the file, and those that no entry of the catalogue describes."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import (
    ConcealedAt,
    HiddenEffect,
    Sizes,
    corrupts,
    draws,
    log,
    log_uniform,
    sets,
    signed,
    then,
    uniform,
    unless_zero,
)
from hil.proof.truth.physics import Physics

FULL_TURN_RAD = 2.0 * np.pi

_acquisition = partial(HiddenEffect, place=ConcealedAt.ACQUISITION)
_load = partial(HiddenEffect, place=ConcealedAt.LOAD)
_motor = partial(HiddenEffect, place=ConcealedAt.MOTOR)
_shaft = partial(HiddenEffect, place=ConcealedAt.SHAFT)
_speed_sensor = partial(HiddenEffect, place=ConcealedAt.SPEED_SENSOR)
_torque_path = partial(HiddenEffect, place=ConcealedAt.TORQUE_PATH)

LIMITS_NM = {("m1",): (180.0, 310.0), ("m2",): (130.0, 220.0), ("m1", "m2"): (150.0, 280.0), ("sum",): (300.0, 480.0)}
"""What is limited, and to what: where the strongest of the three tests asks for somewhat more."""

ORDERS = (1, 3, 4, 6, 12)
"""Periods per turn: eccentricity, three or four pole pairs, slots; faster ones never meet the shaft's resonance. Twice
per turn is left out: to torque and speed it is the Cardan joint's."""

USUAL_TORQUE_NM = 200.0  # torque at which both kinds of ripple are alike

LOST_TOGETHER = (
    (True, True, True),
    (True, True, False),
    (True, False, True),
    (False, True, False),
    (False, False, True),
)
"""What one loss takes along: torque of m1, torque of m2, speed."""

MOST_STAMPED_S = 0.0024
"""A recording whose time steps differ from the period by more than half of it is refused by any reader."""

WAVE_M = (3.6, 5.4)
"""Length of a washboard road's waves: between one and two turns of a wheel of 0.48 m, and neither."""


def _draw_gain(rng: np.random.Generator, bus: Bus) -> Sizes:
    error = log_uniform(rng, 0.05, 0.15)
    return {"gain_m1": 1.0 + error if rng.random() < 0.5 else 1.0 - error}


def _draw_derating(rng: np.random.Generator, bus: Bus) -> Sizes:
    loss = log_uniform(rng, 0.03, 0.25)
    exponential = bool(rng.random() < 0.5)
    return {"loss": loss, "time_constant_s": rng.uniform(4.0, 15.0) if exponential else 0.0}


def _draw_limits(rng: np.random.Generator, bus: Bus) -> Sizes:
    what = list(LIMITS_NM)[rng.integers(len(LIMITS_NM))]
    limit_nm = log_uniform(rng, *LIMITS_NM[what])
    return {
        "limit_m1_nm": limit_nm if "m1" in what else 0.0,
        "limit_m2_nm": limit_nm if "m2" in what else 0.0,
        "limit_total_nm": limit_nm if "sum" in what else 0.0,
        "knee": log_uniform(rng, 6.0, 20.0),
    }


def _draw_ripple(rng: np.random.Generator, bus: Bus) -> Sizes:
    size_nm = log_uniform(rng, 5.0, 40.0)
    cogging = bool(rng.random() < 0.5)
    return {
        "order": float(rng.choice(ORDERS)),
        "ripple_nm": size_nm if cogging else 0.0,
        "ripple_over_torque": 0.0 if cogging else size_nm / USUAL_TORQUE_NM,
    }


def _draw_saturation(rng: np.random.Generator, bus: Bus) -> Sizes:
    positive = log_uniform(rng, 400.0, 1500.0)
    negative = positive if rng.random() < 0.5 else positive * rng.uniform(1.0, 3.0)
    return {"saturating_nm": positive, "saturating_back_nm": negative}


TORQUE_PATH = (
    # Current sensor, magnet temperature of one inverter.
    _torque_path("inverter_gain_mismatch", _draw_gain, sets("gain_m1"), fitted={"gain_m1": "gain_m1"}),
    # As magnets and current sensors warm up: exponentially, or evenly, which has no depth. Recordings begin cold.
    _torque_path(
        "torque_derating",
        _draw_derating,
        sets(derating="loss", derating_time_s="time_constant_s"),
        fitted={
            "depth": lambda sizes, bus: sizes["loss"] if sizes["time_constant_s"] else None,
            "time_constant_s": unless_zero("time_constant_s"),
        },
    ),
    # Voltage or temperature limits the torque, in a knee; the reading, a model inside the inverter, continues.
    _torque_path(
        "torque_saturation",
        _draw_limits,
        sets("limit_m1_nm", "limit_m2_nm", "limit_total_nm", limit_knee="knee"),
        fitted={
            "limit_m1_nm": unless_zero("limit_m1_nm"),
            "limit_m2_nm": unless_zero("limit_m2_nm"),
            "limit_sum_nm": unless_zero("limit_total_nm"),
        },
    ),
    # Current loops of both inverters that are slower than the model thinks.
    _torque_path(
        "actuator_lag",
        draws(current_loop_time_s=log(0.002, 0.025)),
        sets("current_loop_time_s"),
        fitted={"time_constant_s": "current_loop_time_s"},
    ),
    # A fixed time after its reading; any fraction of a sample.
    _torque_path("transport_delay", draws(delay_s=log(0.002, 0.04)), sets("delay_s"), fitted={"delay_s": "delay_s"}),
    # Cogging is there without torque, ripple of the currents grows with it. Recordings begin at different angles.
    _torque_path(
        "torque_ripple",
        _draw_ripple,
        then(
            sets("ripple_nm", ripple_share="ripple_over_torque", ripple_order="order"),
            "ripple_phase_rad",
            0.0,
            FULL_TURN_RAD,
        ),
        fitted={"order": "order", "amplitude_nm": unless_zero("ripple_nm"), "share": unless_zero("ripple_over_torque")},
    ),
)

FURTHER = (
    # The machine saturates: its torque grows less than the current, of one sign more than of the other or of both.
    _torque_path("torque_nonlinearity", _draw_saturation, sets("saturating_nm", "saturating_back_nm")),
    # An offset of the reading that drifts away from the start on, as a current sensor warms.
    _torque_path(
        "torque_bias", draws(bias_nm=signed(6.0, 40.0), bias_half_s=uniform(3.0, 15.0)), sets("bias_nm", "bias_half_s")
    ),
)
"""What the catalogue got later: the order of all effects is what seeds count by."""


def _draw_resolver(rng: np.random.Generator, bus: Bus) -> Sizes:
    once_rad = log_uniform(rng, 0.004, 0.02)
    return {
        "resolver_once_rad": once_rad,
        "resolver_twice_rad": once_rad * rng.uniform(0.2, 0.6),
        "resolver_once_phase_rad": rng.uniform(0.0, FULL_TURN_RAD),
        "resolver_twice_phase_rad": rng.uniform(0.0, FULL_TURN_RAD),
    }


def _misread(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    start_rad = rng.uniform(0.0, FULL_TURN_RAD)
    return physics._replace(
        resolver_once_rad=sizes["resolver_once_rad"],
        resolver_twice_rad=sizes["resolver_twice_rad"],
        resolver_once_phase_rad=sizes["resolver_once_phase_rad"] + start_rad,
        resolver_twice_phase_rad=sizes["resolver_twice_phase_rad"] + 2.0 * start_rad,
    )


def _draw_filter(rng: np.random.Generator, bus: Bus) -> Sizes:
    time_s = log_uniform(rng, 0.0008, 0.007)
    if rng.random() < 0.5:
        return {"time_constant_s": time_s, "corner_rad_s": 0.0, "damping": 1.0}
    damping = rng.uniform(0.65, 1.0)
    return {"time_constant_s": 0.0, "corner_rad_s": 2.0 * damping / time_s, "damping": damping}


def _draw_grid(rng: np.random.Generator, bus: Bus) -> Sizes:
    grid_rad_s = log_uniform(rng, 0.15, 1.0)
    if rng.random() < 0.5:
        return {"grid_rad_s": grid_rad_s, "count_rad": 0.0, "count_time_s": 0.0}
    count_time_s = log_uniform(rng, 0.001, 0.002)
    return {"grid_rad_s": 0.0, "count_rad": grid_rad_s * count_time_s, "count_time_s": count_time_s}


SPEED_SENSOR = (
    # An angle that is off once (eccentricity) and twice (gain) per turn; recordings begin at different angles.
    _speed_sensor(
        "resolver_error",
        _draw_resolver,
        _misread,
        fitted={"once_rad": "resolver_once_rad", "twice_rad": "resolver_twice_rad"},
    ),
    # A digital filter of first or second order at the inverter's cycle of 0.1 ms.
    _speed_sensor(
        "speed_filter",
        _draw_filter,
        sets(filter_time_s="time_constant_s", filter_rad_s="corner_rad_s", filter_damping="damping"),
        fitted={"time_constant_s": unless_zero("time_constant_s")},
    ),
    # The sensor counts pulses: the magnitude of the speed is read.
    _speed_sensor(
        "speed_sign_blind",
        lambda rng, bus: {},
        corrupt=lambda acquisition, sizes: replace(acquisition, sign_blind=True),
    ),
    # Of few digits, or made of few encoder counts.
    _speed_sensor(
        "speed_quantisation",
        _draw_grid,
        corrupt=corrupts("grid_rad_s", "count_rad", "count_time_s"),
        fitted={
            "step_rad_s": lambda sizes, bus: sizes["grid_rad_s"] or sizes["count_rad"] / sizes["count_time_s"],
        },
    ),
)


def _draw_stale(rng: np.random.Generator, bus: Bus) -> Sizes:
    periodic = bool(rng.random() < 0.5)
    share = log_uniform(rng, 0.003, 0.05)
    return {
        "share": 0.0 if periodic else share,
        "most": 0.0 if periodic else float(rng.integers(1, 4)),
        "every": np.ceil(1.0 / share) if periodic else 0.0,
        "whole_rows": float(rng.random() < 0.4),
    }


def _draw_lost(rng: np.random.Generator, bus: Bus) -> Sizes:
    m1, m2, speed = LOST_TOGETHER[rng.integers(len(LOST_TOGETHER))]
    burst = bool(rng.random() < 0.5)
    return {
        "share": log_uniform(rng, 0.003, 0.02) if burst else log_uniform(rng, 0.01, 0.06),
        "most": float(rng.integers(3, 11)) if burst else 1.0,
        "m1": float(m1),
        "m2": float(m2),
        "speed": float(speed),
        "as_zero": float(rng.random() < 1 / 3),
    }


def _draw_jitter(rng: np.random.Generator, bus: Bus) -> Sizes:
    stamped = bool(rng.random() < 0.25)
    return {"jitter_s": log_uniform(rng, 0.001, MOST_STAMPED_S if stamped else 0.003), "stamps_told": float(stamped)}


ACQUISITION = (
    # The previous value once more, of the speed or of the whole row; at random, or in a fixed beat of two clocks. Of
    # random ones each recording has a share of its own.
    _acquisition(
        "stale_samples",
        _draw_stale,
        corrupt=corrupts(stale_share="share", stale_most="most", stale_every="every", stale_rows="whole_rows"),
        fitted={"share": lambda sizes, bus: 1.0 / sizes["every"] if sizes["every"] else None},
    ),
    # NaN and a flag in their row, or a 0 that nobody flagged; single ones, or bursts.
    _acquisition(
        "lost_samples",
        _draw_lost,
        corrupt=corrupts(
            lost_share="share", lost_most="most", lost_m1="m1", lost_m2="m2", lost_speed="speed", lost_as_zero="as_zero"
        ),
    ),
    # Speeds sampled too early or too late; ``time_s`` has the nominal time, or the true one. Root mean square of a
    # uniform deviation over its greatest: 1 / sqrt(3).
    _acquisition(
        "sample_jitter",
        _draw_jitter,
        corrupt=corrupts("jitter_s", "stamps_told"),
        fitted={"jitter_s": lambda sizes, bus: sizes["jitter_s"] / math.sqrt(3.0)},
    ),
    # Inverter and speed sensor have clocks of their own: rows pair what is ever further from each other.
    _acquisition(
        "clock_drift",
        draws(clock_error=signed(60e-6, 3000e-6)),
        corrupt=corrupts("clock_error"),
        fitted={"rate": "clock_error"},
    ),
)


def _corrugate(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    number = FULL_TURN_RAD / sizes["wave_m"]
    height = sizes["load_torque_nm"] / physics.gravity_nm / number
    wave = np.array([[height, number, rng.uniform(0.0, FULL_TURN_RAD)]])
    return physics._replace(road=np.concatenate([physics.road, wave]))


OUTSIDE = (
    # Dead time of the inverters: a small torque does not come at all, a large one falls short.
    _torque_path("torque_deadband", draws(deadband_nm=log(4.0, 25.0)), sets("deadband_nm"), catalogued=False),
    # An inverter that changes its torque no faster than so much in a second; its reading is the demand.
    _torque_path("torque_slew", draws(slew_nm_s=log(2500.0, 12000.0)), sets("slew_nm_s"), catalogued=False),
    # Protection that blocks both inverters for an instant again and again, unseen by their reading.
    _torque_path(
        "torque_dropouts",
        draws(dropout_every_s=uniform(0.7, 3.0), dropout_s=log(0.015, 0.06)),
        sets("dropout_every_s", "dropout_s"),
        catalogued=False,
    ),
    # Oil that the rotor draws along the faster it turns.
    _motor(
        "inertia_by_speed",
        draws(drawn_share=log(0.08, 0.3), drawn_half_rad_s=uniform(10.0, 30.0)),
        sets("drawn_share", "drawn_half_rad_s"),
        catalogued=False,
    ),
    # Stiffer or softer at speed: centrifugal force in the couplings.
    _shaft(
        "speed_stiffened_shaft",
        draws(stiffness_share=signed(0.03, 0.3), half_speed_rad_s=uniform(20.0, 45.0)),
        sets(stiffness_speed_share="stiffness_share", stiffness_speed_rad_s="half_speed_rad_s"),
        catalogued=False,
    ),
    # A washboard road: too fast for a grade, and no whole number of waves meets a turn of wheel or motor.
    _load(
        "corrugated_road", draws(wave_m=uniform(*WAVE_M), load_torque_nm=log(10.0, 80.0)), _corrugate, catalogued=False
    ),
    # A gain that falls with the speed: a demodulator near its end of range.
    _speed_sensor(
        "sensor_curvature", draws(curvature=signed(0.02, 0.15)), corrupt=corrupts("curvature"), catalogued=False
    ),
    # Wrong bits on the way: single speeds that are off by far.
    _acquisition(
        "speed_spikes",
        draws(spike_share=log(0.002, 0.02), spike_rad_s=log(1.5, 8.0)),
        corrupt=corrupts("spike_share", "spike_rad_s"),
        catalogued=False,
    ),
)
