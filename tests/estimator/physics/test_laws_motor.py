"""Effects at the motor, against the reference."""

import numpy as np
import pytest

from estimator.signals.record import FloatArray
from tests.estimator.physics import reference
from tests.estimator.physics.bench import SAMPLE_TIME_S
from tests.estimator.physics.law_bench import (
    SIGN_WIDTH,
    START,
    TIME_S,
    TORQUE,
    assert_law,
    kernel_output,
    measured,
    solved,
    start_vector,
    two_mass,
)
from tests.estimator.physics.reference import Held, lasting


def sign(speed: float) -> float:
    """The sign of a speed as the kernel rounds it."""
    return float(np.tanh(speed / SIGN_WIDTH))


def test_dry_friction_is_a_constant_torque_against_the_motion() -> None:
    line = two_mass(friction=lambda t, w: 30.0 * sign(w))
    assert_law({"coulomb_friction_motor": {"friction_nm": 30.0}}, solved(line))


def test_stribeck_friction_falls_with_speed() -> None:
    line = two_mass(friction=lambda t, w: (15.0 + 25.0 * np.exp(-((w / 0.8) ** 2))) * sign(w))
    values = {"excess_nm": 25.0, "coulomb_nm": 15.0, "stribeck_rad_s": 0.8}
    assert_law({"stribeck_friction": values}, solved(line))


@pytest.mark.parametrize("excess_nm", [0.0, 25.0])
def test_friction_that_deflects_before_it_slides_is_one_more_state(excess_nm: float) -> None:
    """dT/dt = s (w - |w| T / g(w)): a spring until it breaks away, behind by a distance when the motion turns."""
    coulomb_nm, presliding, range_rad_s = 15.0, 4e-3, 0.8
    stiffness = (coulomb_nm + excess_nm) / presliding

    def sliding(w: float) -> float:
        return coulomb_nm + excess_nm * float(np.exp(-((w / range_rad_s) ** 2)))

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        w, bristles = x[reference.SPEED], x[4]
        bending = stiffness * (w - abs(w) * bristles / sliding(w))
        return np.append(two_mass(friction=lambda t, w: bristles)(t, x[:4], torque), bending)

    start = np.append(start_vector(), sliding(START.speed_rad_s))
    expected = reference.solve(rhs, start, Held.of(TORQUE, SAMPLE_TIME_S), TIME_S)[:, reference.SPEED]
    stribeck = {"coulomb_nm": coulomb_nm, "excess_nm": excess_nm, "stribeck_rad_s": range_rad_s}
    effects = {"stribeck_friction": stribeck | {"presliding_rad": presliding}}
    assert_law(effects, expected, tolerance=5e-4)
    rigid = kernel_output({"stribeck_friction": stribeck}, measured())
    assert np.max(np.abs(rigid - expected)) > 2e-3 * np.ptp(expected)
    if excess_nm == 0.0:
        alike = kernel_output(
            {"coulomb_friction_motor": {"friction_nm": 15.0, "presliding_rad": presliding}}, measured()
        )
        np.testing.assert_allclose(alike, kernel_output(effects, measured()), rtol=0, atol=1e-9)


def test_quadratic_friction_grows_with_the_square_of_the_speed() -> None:
    line = two_mass(friction=lambda t, w: 4.0 * w * abs(w))
    assert_law({"quadratic_friction": {"quadratic_nm_s2": 4.0}}, solved(line))


@pytest.mark.parametrize(("from_s", "to_s"), [(0.5, 1.6), (0.5037, 1.7012), (0.9, 9.0)])
def test_a_coupled_generator_adds_its_inertia_for_a_while(from_s: float, to_s: float) -> None:
    line = two_mass(more_motor=lasting(2.5, from_s, to_s))
    effects = {"generator_coupled": {"inertia_kg_m2": 2.5, "from_s": from_s, "to_s": to_s}}
    assert_law(effects, solved(line, (from_s, to_s)))
