"""The shaft's laws: stiffness at zero twist, hardening and softening, and what a gap does to them."""

import numpy as np
import pytest

from estimator.physics.effects.shaft import stiffness_factor
from estimator.physics.kernel import conditions, rates
from estimator.physics.kernel.state_vector import STATES, unpacked
from estimator.physics.laws import inertia_while, share_inside, smooth_sign
from estimator.physics.layout import flat_values
from estimator.signals.record import FloatArray
from tests.estimator.physics.bench import TWO_MASS


def shaft_torque(twist: float, rate: float, p: FloatArray) -> float:
    now = conditions.conditions(2, 0.0, 1e-3, 0.0, 0.0, 0.01, p)
    line = conditions.Line(masses=2, elastic=False, extended=False, own=())
    return rates.shaft_torque(line, twist, rate, now, unpacked(np.zeros(STATES)), p)


def torques(twists: FloatArray, hardening: float, shape: float) -> FloatArray:
    p = flat_values(TWO_MASS, {"stiffness_nonlinearity": {"hardening_per_rad2": hardening, "shape": shape}})
    return np.array([shaft_torque(twist, 0.0, p) for twist in twists])


@pytest.mark.parametrize("shape", [0.5, 1.0, 3.0])
def test_to_first_order_the_stiffness_changes_by_h_times_the_twist_squared(shape: float) -> None:
    for sign in (1.0, -1.0):
        assert (stiffness_factor(1e-3, sign * 50.0, shape) - 1.0) / 1e-6 == pytest.approx(sign * 50.0, rel=1e-3)


def test_softening_of_shape_one_half_ends_in_a_constant_torque() -> None:
    limit = TWO_MASS["k"] / np.sqrt(2.0 * 80.0)
    carried = torques(np.array([0.1, 1.0, 100.0]), -80.0, 0.5)
    assert np.all(np.diff(carried) > 0)
    assert carried[-1] == pytest.approx(limit, rel=1e-4)
    assert carried[-1] < limit


def test_the_damper_engages_over_the_contact_depth() -> None:
    p = flat_values(TWO_MASS, {"backlash": {"gap_rad": 0.04, "contact_rad": 2e-3}})
    depth = 2e-3
    damping = shaft_torque(0.02 + depth, 3.0, p) - shaft_torque(0.02 + depth, 0.0, p)
    assert damping == pytest.approx(TWO_MASS["c"] * 3.0 * (1.0 - np.exp(-1.0)), rel=1e-9)


@pytest.mark.parametrize("pull", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_faces_press_and_pull_as_much_as_the_oil_between_them(side: float, pull: float) -> None:
    p = flat_values(TWO_MASS, {"backlash": {"gap_rad": 0.04, "contact_rad": 1e-4, "pull": pull}})
    spring, damping = 0.001 * TWO_MASS["k"], 5.0 * TWO_MASS["c"]
    assert spring < damping
    assert shaft_torque(side * 0.021, side * 5.0, p) == pytest.approx(side * (spring + damping), rel=1e-3)
    assert shaft_torque(side * 0.021, side * -5.0, p) == pytest.approx(side * pull * (spring - damping), rel=1e-3)


@pytest.mark.parametrize("across", [0.4, 1.0])
def test_a_damper_across_the_gap_acts_in_it_and_the_faces_have_the_rest(across: float) -> None:
    values = {"gap_rad": 0.04, "contact_rad": 1e-5, "pull": 0.0, "across": across}
    p, damping = flat_values(TWO_MASS, {"backlash": values}), 5.0 * TWO_MASS["c"]
    assert shaft_torque(0.01, 5.0, p) == pytest.approx(across * damping)
    assert shaft_torque(0.05, 5.0, p) == pytest.approx(0.03 * TWO_MASS["k"] + damping)


@pytest.mark.parametrize(
    ("speed", "sign"), [(0.0, 0.0), (1.0, 1.0), (-1.0, -1.0), (0.02, np.tanh(1.0)), (-0.38, -np.tanh(19.0))]
)
def test_the_rounded_sign(speed: float, sign: float) -> None:
    assert smooth_sign(speed, 0.02) == pytest.approx(sign, abs=1e-12)


@pytest.mark.parametrize(("share", "inertia"), [(0.0, 2.0), (1.0, 8.0), (0.5, 3.2)])
def test_an_inertia_for_part_of_the_time_is_the_harmonic_mean(share: float, inertia: float) -> None:
    assert inertia_while(2.0, 6.0, share) == pytest.approx(inertia)  # half the time each: 2 / (1/2 + 1/8)


@pytest.mark.parametrize(
    ("low", "high", "share"), [(0.0, 9.0, 1.0), (2.0, 9.0, 0.0), (1.25, 9.0, 0.75), (1.25, 1.5, 0.25), (0.0, 1.5, 0.5)]
)
def test_how_much_of_a_step_lies_in_an_event(low: float, high: float, share: float) -> None:
    assert share_inside(1.0, 1.0, low, high) == pytest.approx(share)
