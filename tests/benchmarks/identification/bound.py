"""The least error that any unbiased estimate of a bus can have: Cramér and Rao's bound, the noise's spectrum known.

The speed of the motor is ``G u + v``: u as read, v what the road, gusts, the counts of the torque and the sensor make
of it. By Whittle's likelihood (Ljung, System Identification, 2nd ed., section 7.4; Porat, Digital Processing of Random
Signals, 1994) the information about the six parameters of the line is

    sum over the frequencies of  2 |dG/dtheta U|^2 / Phi_v  +  d ln Phi_v / dtheta  d ln Phi_v / dtheta'

of which the second part is what the noise itself tells of the line that it passes; level, slope and curvature of its
spectrum are taken as unknown. A method that knows less of the noise, as all here do, can do no better.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.benchmarks import buses
from tests.benchmarks.buses import Array, Bus, Line, World
from tests.benchmarks.identification.methods import HIGH_PASS_HZ, Case

STEP = 1e-4  # relative, of a parameter in the derivatives
TWIST, MOTOR_SPEED = 0, 1
ALIASES = range(-buses.ROAD_STEPS // 2, buses.ROAD_STEPS // 2)


def least_errors(case: Case, world: World) -> tuple[float, float]:
    """Return the least standard deviations of frequency and damping, each relative to its truth."""
    total = case.record.torque_nm.sum(axis=1)
    n = total.size
    omega = 2.0 * math.pi * np.fft.rfftfreq(n, buses.PERIOD_S)
    kept = (omega > 2.0 * math.pi * HIGH_PASS_HZ) & (omega < math.pi / buses.PERIOD_S)
    power, omega = (np.abs(np.fft.rfft(total - total.mean())) ** 2 / n)[kept], omega[kept]
    values = np.array(list(case.bus.line.parameters.values()))
    ends = [(Line(*values * (1.0 + d)), Line(*values * (1.0 - d))) for d in STEP * np.eye(values.size)]

    def slopes(of: Callable[[Line], Any]) -> Array:  # by the logarithm of each parameter
        return np.array([(of(up) - of(down)) / (2.0 * STEP) for up, down in ends])

    response = slopes(lambda line: _responses(line, omega, buses.PERIOD_S)[:, buses.MOTOR])
    noise = slopes(lambda line: np.log(_noise(case.bus, line, omega, world)))
    octaves = np.log(omega / omega.mean())
    noise = np.vstack([noise, np.ones_like(octaves), octaves, octaves**2])
    information = noise @ noise.T
    weight = power / _noise(case.bus, case.bus.line, omega, world)
    information[: values.size, : values.size] += 2.0 * np.real((response * weight) @ response.conj().T)
    covariance = np.linalg.inv(information)[: values.size, : values.size]
    resonance = slopes(lambda line: np.log(line.resonance())).T
    frequency, damping = np.sqrt(np.diag(resonance @ covariance @ resonance.T))
    return float(frequency), float(damping)


def _responses(line: Line, omega: Array, period_s: float) -> Array:
    """Return the motor's speed by both torques, held over a period, at frequencies [rad/s]; shape (n, 2)."""
    relative = np.array(
        [[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    )  # the twist and both speeds
    A, B = line.held(period_s)
    A, B = relative @ A @ np.linalg.pinv(relative), relative @ B
    z = np.exp(1j * omega * period_s)
    resolvent = z[:, np.newaxis, np.newaxis] * np.eye(3) - A
    return np.linalg.solve(resolvent, np.broadcast_to(B.astype(np.complex128), (omega.size, 3, 2)))[:, MOTOR_SPEED]


def _noise(bus: Bus, line: Line, omega: Array, world: World) -> Array:
    """Return the spectral density of v, two-sided per sample [rad^2/s^2]."""
    counts = 2.0 * buses.COUNT_NM**2 / 12.0
    density = bus.noise_rad_s**2 + counts * np.abs(_responses(line, omega, buses.PERIOD_S)[:, buses.MOTOR]) ** 2
    if not world.road:
        return density
    step_s = buses.PERIOD_S / buses.ROAD_STEPS
    for alias in ALIASES:
        folded = omega + 2.0 * math.pi * alias / buses.PERIOD_S
        passed = np.abs(_responses(line, folded, step_s)[:, buses.LOAD]) ** 2
        density = density + passed * _load(bus, folded, step_s) / buses.ROAD_STEPS
    return density


def _load(bus: Bus, omega: Array, step_s: float) -> Array:
    """Return the spectral density of the load torque, per step of the road [Nm^2]; hills are slower than counts."""
    q, step_m = np.exp(-1j * omega * step_s), bus.speed_m_s * step_s
    kept, lasting = math.exp(-step_m / buses.PATCH_M), math.exp(-step_s / buses.GUST_S)
    tyre = np.abs((1.0 - kept) / (1.0 - kept * q)) ** 2
    axles = np.abs(buses.FRONT_SHARE + (1.0 - buses.FRONT_SHARE) * q ** round(buses.WHEELBASE_M / step_m)) ** 2
    slope = (2.0 * math.pi * buses.REFERENCE_PER_M) ** 2 * bus.road.roughness_m3 / (2.0 * step_m)
    weight_nm = bus.mass_kg * buses.GRAVITY_M_S2 * buses.METRES_PER_RAD
    gusts = bus.road.gust_nm**2 * (1.0 - lasting**2) / np.abs(1.0 - lasting * q) ** 2
    return weight_nm**2 * slope * tyre * axles + gusts
