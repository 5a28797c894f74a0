"""The driver before the recording: rolls at a speed on level road and holds the pedal still."""

from __future__ import annotations

from dataclasses import dataclass

from hil.proof.truth.driveline import TruthDriveline
from hil.proof.truth.laws import eddy_torque, torque_by_direction
from hil.proof.truth.physics import FLAT_ROAD, Physics

_SETTLING_S = 3.0
"""The shaft's oscillation, 2.5 1/s and faster, is down to 0.06 % by then."""


@dataclass(frozen=True, slots=True)
class Rolling:
    """A bus rolling steadily, and the torque reading that keeps it so [Nm]."""

    driveline: TruthDriveline
    torque_nm: float


def holding_torque(physics: Physics, speed_rad_s: float, share_m1: float) -> float:
    """Return the torque reading of both inverters together that holds a speed on level road [Nm].

    At standstill that is the constant load torque alone: dry friction needs no pedal. Friction that varies with
    the angle is left out: over a turn it holds nothing back.
    """
    p = physics
    torque_nm = p.load_torque_nm + (p.b_M + p.b_L * p.cold_factor) * speed_rad_s
    torque_nm += (p.quadratic_motor + p.quadratic_load) * speed_rad_s * abs(speed_rad_s)
    if speed_rad_s:
        torque_nm += p.friction_motor_nm + p.friction_load_nm
    torque_nm = torque_nm / p.efficiency + eddy_torque(p, speed_rad_s) + torque_by_direction(p, speed_rad_s)
    return torque_nm / (p.gain_m1 * share_m1 + 1.0 - share_m1) + 2.0 * p.deadband_nm


def before_the_recording(physics: Physics) -> Physics:
    """Return the physics of the way to the start: on level road, and before anything that time brings."""
    return physics._replace(
        road=FLAT_ROAD,
        brake_nm=0.0,
        generator_inertia=0.0,
        stiffness_step=0.0,
        payload_share=0.0,
        derating=0.0,
        bias_nm=0.0,
        dropout_every_s=0.0,
        b_L=physics.b_L * physics.cold_factor,
        cold_factor=1.0,
    )


def bring_to_speed(physics: Physics, speed_rad_s: float, share_m1: float) -> Rolling:
    """Let the shaft settle at a speed, with `before_the_recording`; then ``physics`` begins."""
    torque_nm = holding_torque(physics, speed_rad_s, share_m1)
    driveline = TruthDriveline(before_the_recording(physics), speed_rad_s)
    driveline.advance((share_m1 * torque_nm, (1.0 - share_m1) * torque_nm), _SETTLING_S)
    driveline.continue_with(physics)
    return Rolling(driveline, torque_nm)
