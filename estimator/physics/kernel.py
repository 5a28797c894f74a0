"""The one compiled driveline simulation, with the law of every effect at its place.

Chain of one sub-step: torque reading -> delay -> lag -> motor -> shaft -> load. Fixed-step Runge-Kutta of fourth
order; the torque of a sub-step is the exact mean of the delayed, lagged, zero-order-held reading over it.

State: motor angle [rad], motor speed [rad/s], twist [rad], load speed [rad/s], lagged torque [Nm].
"""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.physics.effects import (
    actuator_lag,
    backlash,
    coulomb_friction_motor,
    stiffness_nonlinearity,
    stribeck_friction,
    transport_delay,
)
from estimator.physics.laws import beyond_gap
from estimator.physics.layout import slot
from estimator.signals.record import FloatArray

ANGLE, SPEED, TWIST, LOAD_SPEED, LAGGED = 0, 1, 2, 3, 4
STATES = 5
MECHANICAL = 4

J_M, J_L, K, C, B_M, B_L = (slot("", name) for name in ("J_M", "J_L", "k", "c", "b_M", "b_L"))
LAG = slot("actuator_lag", "time_constant_s")
DELAY = slot("transport_delay", "delay_s")
COULOMB = slot("coulomb_friction_motor", "friction_nm")
STRIBECK = slot("stribeck_friction", "excess_nm")
STRIBECK_COULOMB = slot("stribeck_friction", "coulomb_nm")
STRIBECK_SPEED = slot("stribeck_friction", "stribeck_rad_s")
GAP = slot("backlash", "gap_rad")
CONTACT = slot("backlash", "contact_rad")
HARDENING = slot("stiffness_nonlinearity", "hardening_per_rad2")
SHAPE = slot("stiffness_nonlinearity", "shape")

STICK_STABILITY = 1.5
"""Runge-Kutta is stable to h * slope / J = 2.78; friction's slope at standstill is held to about half of it."""


@compiled
def motor_friction(speed: float, p: FloatArray, width: float) -> float:
    """Return the torque of every friction law at the motor [Nm], viscous included."""
    return (
        float(p[B_M]) * speed
        + coulomb_friction_motor.law(speed, p[COULOMB], width)
        + stribeck_friction.law(speed, p[STRIBECK], p[STRIBECK_COULOMB], p[STRIBECK_SPEED], width)
    )


@compiled
def shaft_torque(twist: float, rate: float, p: FloatArray) -> float:
    """Return the torque the shaft carries [Nm] at a twist [rad] and its rate [rad/s]."""
    damping = float(p[C]) * rate
    loaded = twist
    if p[GAP] > 0.0:
        loaded = beyond_gap(twist, p[GAP])
        damping *= backlash.damping_share(loaded, p[CONTACT])
    return float(p[K]) * loaded * stiffness_nonlinearity.factor(loaded, p[HARDENING], p[SHAPE]) + damping


@compiled
def rates(masses: int, torque: float, load: float, x: FloatArray, p: FloatArray, width: float, dx: FloatArray) -> None:
    """Write the time derivative of the mechanical state into ``dx``."""
    drive = torque - motor_friction(x[SPEED], p, width)
    dx[ANGLE] = x[SPEED]
    if masses == 1:
        dx[SPEED] = (drive - load) / p[J_M]
        dx[TWIST] = 0.0
        dx[LOAD_SPEED] = 0.0
        return
    rate = x[SPEED] - x[LOAD_SPEED]
    shaft = shaft_torque(x[TWIST], rate, p)
    dx[SPEED] = (drive - shaft) / p[J_M]
    dx[TWIST] = rate
    dx[LOAD_SPEED] = (shaft - p[B_L] * x[LOAD_SPEED] - load) / p[J_L]


@compiled
def runge_kutta(
    masses: int,
    torque: float,
    load: float,
    state: FloatArray,
    p: FloatArray,
    width: float,
    h: float,
    work: FloatArray,
) -> None:
    """Advance the mechanical state by one sub-step of constant torque and load; ``work`` is scratch (3, STATES)."""
    x, dx, total = work[0], work[1], work[2]
    for i in range(MECHANICAL):
        x[i] = state[i]
        total[i] = 0.0
    for stage in range(4):
        rates(masses, torque, load, x, p, width, dx)
        weight = 2.0 if stage == 1 or stage == 2 else 1.0
        reach = h if stage == 2 else 0.5 * h
        for i in range(MECHANICAL):
            total[i] += weight * dx[i]
            x[i] = state[i] + reach * dx[i]
    for i in range(MECHANICAL):
        state[i] += h / 6.0 * total[i]


@compiled
def integrate(
    masses: int,
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    first: int,
    torque: FloatArray,
    load: FloatArray,
    p: FloatArray,
    state: FloatArray,
    output: int,
    out: FloatArray,
) -> None:
    """Simulate samples ``first`` to the end of ``torque``; row k of ``out`` is the state entry before torque k acts.

    Parameters
    ----------
    masses : int
        1 or 2.
    sample_time_s : float
        Sampling period [s].
    substeps : int
        Integration steps per period.
    sign_width : float
        Speed within which dry friction changes sign [rad/s].
    first : int
        Sample to start at; earlier torques are only seen through the delay.
    torque, load : ndarray, shape (N,)
        Torque reading, held over each period, and load torque [Nm].
    p : ndarray, shape (layout.SIZE,)
        Parameters of the superset model.
    state : ndarray, shape (STATES,)
        Start state; the end state afterwards.
    output : int
        Which state is the output.
    out : ndarray, shape (N,)
        Filled from ``first`` on.
    """
    h = sample_time_s / substeps
    dry = p[COULOMB] + p[STRIBECK] + p[STRIBECK_COULOMB]
    width = max(sign_width, dry * h / (STICK_STABILITY * p[J_M]))
    delay = p[DELAY] / sample_time_s
    length = 1.0 / substeps
    work = np.zeros((3, STATES))
    for k in range(first, torque.shape[0]):
        out[k] = state[output]
        for j in range(substeps):
            reading = transport_delay.delayed_mean(torque, k + j * length - delay, length)
            mean, end = actuator_lag.step(reading, state[LAGGED], p[LAG], h)
            state[LAGGED] = end
            runge_kutta(masses, mean, load[k], state, p, width, h, work)
