"""The state in which a simulation starts: what is unknown of it, and what follows from that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.physics.kernel import bristles, sensing, slots, state_vector
from estimator.physics.kernel.conditions import branch_frequency, branch_inertia
from estimator.signals.record import FloatArray

PRESLIDING = np.array(
    [slots.COULOMB_PRESLIDING, slots.STRIBECK_PRESLIDING, slots.COULOMB_LOAD_PRESLIDING, slots.BRAKE_PRESLIDING]
)
"""Deflections to which dry friction bends before it slides."""


@dataclass(frozen=True, slots=True)
class Start:
    """What is unknown in every recording: constant load torque [Nm] and initial state [rad, rad/s].

    Of a joint also the preload behind its gap [Nm].
    """

    load_torque_nm: float
    angle_rad: float
    speed_rad_s: float
    twist_rad: float = 0.0
    load_speed_rad_s: float = 0.0
    middle_twist_rad: float = 0.0
    middle_speed_rad_s: float = 0.0
    preload_nm: float = 0.0


def initial_state(start: Start, torque_nm: float, angle_rad: float, p: FloatArray) -> FloatArray:
    """Return the kernel's state at the start: what is not unknown follows from the rest as if it were steady."""
    return np.array(
        [
            *state_vector.State(
                angle=start.angle_rad,
                speed=start.speed_rad_s,
                twist=start.twist_rad,
                load_speed=start.load_speed_rad_s,
                loading=0.0,
                vehicle_speed=start.load_speed_rad_s,
                branch_twist=_twist_beside_shaft(start.twist_rad, p),
                branch_speed=start.load_speed_rad_s if p[slots.BEHIND] > 0.0 else start.speed_rad_s,
                middle_twist=start.middle_twist_rad,
                middle_speed=start.middle_speed_rad_s,
                traction=start.load_torque_nm,
            ),
            torque_nm + p[slots.LAGGED_BEFORE],
            -p[slots.LAGGED_BEFORE],
            sensing.reading(start.speed_rad_s, angle_rad, p) + p[slots.FILTERED_BEFORE],
            -p[slots.FILTERED_BEFORE],
            *_held_by_bristles(start, p),
        ]
    )


def _held_by_bristles(start: Start, p: FloatArray) -> tuple[float, float]:
    """Return what bristles at motor and load hold [Nm] of friction that has slid for long; 0 where none bend."""
    if not p[PRESLIDING].any():  # compiled code takes its time to be called from here
        return 0.0, 0.0
    carried_rad_s = start.load_speed_rad_s if p[slots.J_L] > 0.0 else start.speed_rad_s
    return (
        bristles.slid(start.speed_rad_s, bristles.sliding(start.speed_rad_s, p)),
        bristles.slid(carried_rad_s, float(p[slots.COULOMB_LOAD])),
    )


def _twist_beside_shaft(twist_rad: float, p: FloatArray) -> float:
    """Return the twist of another spring of the line [rad] that carries what the shaft does; 0 where there is none."""
    if p[slots.BETWEEN] <= 0.0 and p[slots.BEHIND] <= 0.0:
        return 0.0
    return float(p[slots.K] * twist_rad / (branch_inertia(p) * branch_frequency(p) ** 2))
