"""Drives of buses that are no two masses: the proof's truth with dry friction, drag, hills, a lag and a resolver error.

Shares nothing with the model that is identified, nor with the linear drives of :mod:`drives` and :mod:`roads`.
"""

import numpy as np

from estimator.signals.record import Record
from hil.proof.truth import kernel
from hil.proof.truth.driveline import bring_to_speed, holding_torque, observed
from hil.proof.truth.recording import speed_reading, torque_reading
from hil.proof.truth.specimen import Stream, draw_specimen, stream
from tests.estimator.identification.tracking.roads import PERIOD_S, Course

EFFECTS = "coulomb_friction_load+aerodynamic_drag+road_grade+actuator_lag+resolver_error"
RESOLVER_SHARE = 0.2
"""Of the proof's resolver errors, which are there to be found: up to 15 minutes of arc, as data sheets have them."""

CHUNK = 100
"""Samples over which the stiffness stays as it is and the pedal moves evenly."""

HOLD_S = 30.0
"""Time in which the driver brings the speed back."""


def drive(
    seed: int, duration_s: float, prbs_nm: Course = lambda time_s: 120.0, stiffness: Course = lambda time_s: 1.0
) -> Record:
    """Drive such a bus, its driver a slow speed hold with small corrections; as :func:`roads.drive` otherwise."""
    specimen, rng = draw_specimen(EFFECTS, seed), stream(seed, Stream.RECORDING, 0)
    physics = specimen.physics(rng)
    physics = physics._replace(
        resolver_once_rad=RESOLVER_SHARE * physics.resolver_once_rad,
        resolver_twice_rad=RESOLVER_SHARE * physics.resolver_twice_rad,
    )
    speed_rad_s, n = float(rng.uniform(60.0, 100.0)), round(duration_s / PERIOD_S)
    base_nm = holding_torque(physics, speed_rad_s, 0.5)
    state = bring_to_speed(physics, speed_rad_s, 0.5).driveline.state
    levels = 2.0 * rng.integers(0, 2, n // 2 + 1) - 1.0
    pedal_nm, torque, speed = base_nm, np.empty(n), np.empty(n)
    for first in range(0, n, CHUNK):
        time_s = first * PERIOD_S
        k = np.arange(first, min(first + CHUNK, n))
        now = physics._replace(k=physics.k * stiffness(time_s))
        hold_nm = base_nm + (physics.J_M + physics.J_L) / HOLD_S * (
            speed_rad_s - observed(now, state[np.newaxis])[0][0]
        )
        before_nm, pedal_nm = pedal_nm, hold_nm + rng.normal(0.0, 5.0)
        torque[k] = np.linspace(before_nm, pedal_nm, k.size) + prbs_nm(time_s) * levels[k // 2]
        states = kernel.course(state, now, torque[k], np.full(k.size, PERIOD_S))
        speed[k] = observed(now, np.concatenate([states[:1], states[:-1]]))[0]
    halves = np.column_stack([torque_reading(0.5 * torque, rng), torque_reading(0.5 * torque, rng)])
    okay = np.ones(n, dtype=np.bool_)
    return Record(f"dirty_{seed}", PERIOD_S, PERIOD_S * np.arange(n), halves, speed_reading(speed, rng), okay)
