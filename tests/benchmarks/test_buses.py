"""The benchmarks' buses are what they say: the line's mathematics, the road's spectrum, the driver, the readings."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import welch

from tests.benchmarks.buses import (
    CLEAN,
    FRONT_SHARE,
    GRAVITY_M_S2,
    METRES_PER_RAD,
    PATCH_M,
    PERIOD_S,
    Line,
    draw_bus,
    drive,
    surface,
)

LINE = Line(1.6, 100.0, 4200.0, 9.0, 0.35, 0.9)
STEP_S = 0.001


def test_the_resonance_is_a_root_of_the_characteristic_polynomial() -> None:
    """Of (J_M s + b_M)(J_L s^2 + (c + b_L) s + k) + (c s + k)(J_L s + b_L), worked out by hand from both balances."""
    J_M, J_L, k, c, b_M, b_L = LINE.parameters.values()
    motor, load = np.polymul([J_M, b_M], [J_L, c + b_L, k]), np.polymul([c, k], [J_L, b_L])
    s = max(np.roots(np.polyadd(motor, load)), key=lambda root: root.imag)
    assert LINE.resonance() == pytest.approx((abs(s) / (2 * np.pi), -s.real / abs(s)), rel=1e-9)


def test_a_held_torque_moves_the_line_as_an_integrator_does() -> None:
    F, G = LINE.system()
    A, B = LINE.held(PERIOD_S)
    x, torque = np.array([0.01, 0.0, 80.0, 79.0]), np.array([150.0, 90.0])
    by_steps = solve_ivp(lambda _, x: F @ x + G @ torque, (0.0, PERIOD_S), x, rtol=1e-10, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(A @ x + B @ torque, by_steps, rtol=1e-8, atol=1e-10)


def test_the_surface_has_the_spectrum_of_the_standard() -> None:
    """At frequencies below the patch's: slope density (2 pi n_0)^2 G_d per cycle and metre, over speed, two axles."""
    bus = draw_bus(2)
    torque_nm = surface(bus, 400_000, STEP_S, np.random.default_rng(1))
    frequency_hz, density = welch(torque_nm, 1 / STEP_S, nperseg=40_000)
    band = (frequency_hz > 2.0) & (frequency_hz < 6.0)
    slope_m = (2 * np.pi * 0.1) ** 2 * bus.road.roughness_m3
    weight_nm = bus.mass_kg * GRAVITY_M_S2 * METRES_PER_RAD
    axles = FRONT_SHARE**2 + (1 - FRONT_SHARE) ** 2  # apart by far more than a wavelength: their phase averages out
    per_m = frequency_hz[band] / bus.speed_m_s
    patch = 1.0 / (1.0 + (2 * np.pi * per_m * PATCH_M) ** 2)
    expected = weight_nm**2 * axles * slope_m / bus.speed_m_s * patch
    assert density[band].mean() == pytest.approx(expected.mean(), rel=0.05)


def test_a_recording_follows_the_line_from_its_own_torques() -> None:
    """Clean, the speed that the recorded torques give from the state found by least squares leaves noise and ripple."""
    bus = draw_bus(5)
    record = drive(bus, 10.0, world=CLEAN)
    A, B = bus.line.held(PERIOD_S)
    columns = [np.eye(4)[i] for i in range(4)]
    rows = []
    x, free = np.zeros(4), np.array(columns).T
    constant = np.zeros(4)
    for torque_nm in record.total_torque_nm:
        rows.append([x[2], *free[2], constant[2]])
        x, free = A @ x + B[:, 0] * torque_nm, A @ free
        constant = A @ constant + B[:, 1]
    forced, *unknown = np.array(rows).T
    left = record.output - forced
    rest = left - np.column_stack(unknown) @ np.linalg.lstsq(np.column_stack(unknown), left, rcond=None)[0]
    assert rest.std() < 2.0 * bus.noise_rad_s
