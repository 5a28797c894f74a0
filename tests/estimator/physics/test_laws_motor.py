"""Effects at the motor, against the reference."""

from __future__ import annotations

import numpy as np
import pytest

from tests.estimator.physics.law_bench import SIGN_WIDTH, assert_law, solved, two_mass
from tests.estimator.physics.reference import lasting


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


def test_quadratic_friction_grows_with_the_square_of_the_speed() -> None:
    line = two_mass(friction=lambda t, w: 4.0 * w * abs(w))
    assert_law({"quadratic_friction": {"quadratic_nm_s2": 4.0}}, solved(line))


@pytest.mark.parametrize(("from_s", "to_s"), [(0.5, 1.6), (0.5037, 1.7012), (0.9, 9.0)])
def test_a_coupled_generator_adds_its_inertia_for_a_while(from_s: float, to_s: float) -> None:
    line = two_mass(more_motor=lasting(2.5, from_s, to_s))
    effects = {"generator_coupled": {"inertia_kg_m2": 2.5, "from_s": from_s, "to_s": to_s}}
    assert_law(effects, solved(line, (from_s, to_s)))
