"""Driveline of the truth as a plant: inverters, transport delay, what the resolver reads, the way to the start."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from hil.proof.truth import kernel, laws
from hil.proof.truth.compiled import compiled
from hil.proof.truth.laws import brake_torque, eddy_torque, gravity_torque, resolver_speed, torque_by_direction
from hil.proof.truth.physics import FLAT_ROAD, SPEEDS, STATES, FloatArray, Physics, StateIndex

_SETTLING_S = 3.0  # the shaft's oscillation, 2.5 1/s and faster, is down to 0.06 % by then


@compiled
def true_torques(p: Physics, m1_nm: FloatArray, m2_nm: FloatArray, times_s: FloatArray) -> FloatArray:
    """Return `true_torque` for readings and times of shape (N,)."""
    total_nm = np.empty(times_s.size)
    for i in range(times_s.size):
        total_nm[i] = true_torque(p, (m1_nm[i], m2_nm[i]), times_s[i])
    return total_nm


@compiled
def true_torque(p: Physics, reading_nm: tuple[float, float], time_s: float) -> float:
    """Return the torque of both inverters together for their readings at a time [Nm]."""
    left = laws.torque_left(p, time_s)
    m1 = left * _beyond(p.gain_m1 * reading_nm[0], p.deadband_nm)
    m2 = left * _beyond(reading_nm[1], p.deadband_nm)
    both = _limited(m1, p.limit_m1_nm, p.limit_knee) + _limited(m2, p.limit_m2_nm, p.limit_knee)
    given = _saturated(p, _limited(both, p.limit_total_nm, p.limit_knee)) + laws.bias_torque(p, time_s)
    return 0.0 if laws.is_blocked(p, time_s) else given


@compiled
def _beyond(torque_nm: float, deadband_nm: float) -> float:
    return math.copysign(max(0.0, abs(torque_nm) - deadband_nm), torque_nm)


@compiled
def _saturated(p: Physics, torque_nm: float) -> float:
    """Return ``S asinh(T / S)``: nearly T while small, growing ever less."""
    size = p.saturating_nm if torque_nm > 0.0 else p.saturating_back_nm
    return size * math.asinh(torque_nm / size) if size > 0.0 else torque_nm


@compiled
def _limited(torque_nm: float, limit_nm: float, knee: float) -> float:
    """Return a torque below its limit, which is approached in a knee and not at an edge."""
    if limit_nm <= 0.0:
        return torque_nm
    over = abs(torque_nm) / limit_nm
    return float(torque_nm * (1.0 + over**knee) ** (-1.0 / knee))


@dataclass(frozen=True, slots=True)
class Piece:
    """A constant torque over a stretch of time."""

    torque_nm: float  # of both inverters together
    duration_s: float  # how long it is held


class DelayLine:
    """Hold every torque back by a fixed time."""

    def __init__(self, delay_s: float) -> None:
        self._waiting: deque[Piece] = deque([Piece(0.0, delay_s)] if delay_s > 0.0 else [])

    def push(self, torque_nm: float, duration_s: float) -> list[Piece]:
        """Feed a torque for a time; return what comes out during that time, in order."""
        self._waiting.append(Piece(torque_nm, duration_s))
        leaving: list[Piece] = []
        left_s = duration_s
        while left_s > 0.0:
            first = self._waiting.popleft()
            if first.duration_s > left_s:
                self._waiting.appendleft(Piece(first.torque_nm, first.duration_s - left_s))
                first = Piece(first.torque_nm, left_s)
            leaving.append(first)
            left_s -= first.duration_s
        return leaving


@compiled
def speed_as_sensed(p: Physics, state: FloatArray) -> float:
    """Return the motor speed as the resolver gives it, behind its filter where it has one [rad/s]."""
    if p.filter_time_s > 0.0 or p.filter_rad_s > 0.0:
        return float(state[StateIndex.FILTERED])
    return float(resolver_speed(p, state[StateIndex.ANGLE_M], state[StateIndex.SPEED_M]))


@compiled
def observed(p: Physics, states: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return speeds [rad/s] and torques against the load beyond the constant one [Nm] of states, shape (N, STATES)."""
    speed, disturbance = np.empty(states.shape[0]), np.empty(states.shape[0])
    for i in range(states.shape[0]):
        speed[i] = speed_as_sensed(p, states[i])
        disturbance[i] = gravity_torque(p, states[i, StateIndex.ANGLE_L]) + brake_torque(
            p, states[i, StateIndex.TIME_S]
        )
    return speed, disturbance


class TruthDriveline:
    """A driveline with all it hides; has the shape of ``hil.simulator.simulated_rig.SimulatedPlant``.

    Its clock stands at zero for ``still_s``: moments and courses over time count from then.
    """

    def __init__(self, physics: Physics, speed_rad_s: float = 0.0, still_s: float = 0.0) -> None:
        self._physics = physics
        self._still_s = still_s
        self._delay = DelayLine(physics.delay_s)
        self._state = np.zeros(STATES)
        self._state[list(SPEEDS)] = speed_rad_s

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Hold both inverters' torque [Nm] for a time [s]."""
        total_nm = true_torque(self._physics, torque_nm, float(self._state[StateIndex.TIME_S]))
        for piece in self._delay.push(total_nm, duration_s):
            kernel.advance(self._state, self._physics, piece.torque_nm, piece.duration_s)
        if self._still_s > 0.0:
            self._still_s -= duration_s
            self._state[StateIndex.TIME_S] = 0.0

    def course(self, m1_nm: FloatArray, m2_nm: FloatArray, durations_s: FloatArray) -> FloatArray:
        """Hold torques for their times, shapes (N,), one after the other; return the states after each, (N, STATES)."""
        begins_s = self._state[StateIndex.TIME_S] + np.cumsum(durations_s) - durations_s
        pieces = [
            self._delay.push(total_nm, duration_s)
            for total_nm, duration_s in zip(
                true_torques(self._physics, m1_nm, m2_nm, begins_s).tolist(), durations_s.tolist(), strict=True
            )
        ]
        ends = np.cumsum([len(each) for each in pieces]) - 1
        commands_nm = np.array([piece.torque_nm for each in pieces for piece in each])
        held_s = np.array([piece.duration_s for each in pieces for piece in each])
        states: FloatArray = kernel.course(self._state, self._physics, commands_nm, held_s)[ends]
        return states

    def continue_with(self, physics: Physics) -> None:
        """Change the physics under way: motion and twist continue, clock and distance start again at zero."""
        self._physics = physics
        self._state[[StateIndex.ANGLE_M, StateIndex.ANGLE_X]] -= self._state[StateIndex.ANGLE_L]
        self._state[[StateIndex.TIME_S, StateIndex.ANGLE_L]] = 0.0

    def quantity(self, which: StateIndex) -> float:
        """Return one of the true quantities, which no sensor shows."""
        return float(self._state[which])

    @property
    def state(self) -> FloatArray:
        """Copy of the true state, shape (STATES,), in the order of `StateIndex`."""
        return self._state.copy()

    @property
    def physics(self) -> Physics:
        """What it is made of now."""
        return self._physics

    @property
    def speed_rad_s(self) -> float:
        """Motor speed as the resolver gives it, behind its filter where it has one [rad/s]."""
        return float(speed_as_sensed(self._physics, self._state))


@dataclass(frozen=True, slots=True)
class Rolling:
    """A bus rolling steadily, and the torque reading that keeps it so [Nm]."""

    driveline: TruthDriveline  # its clock and distance at zero
    torque_nm: float  # both inverters together


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
