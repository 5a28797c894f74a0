"""The shaft's laws: stiffness at zero twist, hardening and softening, and what a gap does to them."""

import numpy as np
import pytest

from estimator.physics.effects.shaft import damping_share, loading_rate, stiffness_factor
from estimator.physics.kernel import rates, slots
from estimator.physics.laws import beyond_gap, inertia_while, share_inside, smooth_sign
from estimator.physics.layout import flat_values
from estimator.signals.record import FloatArray
from tests.estimator.physics.bench import TWO_MASS


def shaft_torque(twist: float, rate: float, p: FloatArray, loading: float = 0.0) -> float:
    return rates.shaft_torque(twist, rate, loading, p, p[slots.K])


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


@pytest.mark.parametrize(("twist", "share"), [(0.0, 0.0), (1e-9, 1.0), (-0.3, 1.0)])
def test_without_a_contact_depth_the_damper_acts_at_first_touch(twist: float, share: float) -> None:
    assert damping_share(twist, 0.0) == share


@pytest.mark.parametrize(("twist", "beyond"), [(0.0, 0.0), (0.05, 0.0), (-0.05, 0.0), (0.08, 0.03), (-0.08, -0.03)])
def test_what_lies_beyond_a_gap(twist: float, beyond: float) -> None:
    assert beyond_gap(twist, 0.1) == pytest.approx(beyond, abs=1e-15)


@pytest.mark.parametrize(
    ("speed", "sign"), [(0.0, 0.0), (1.0, 1.0), (-1.0, -1.0), (0.02, np.tanh(1.0)), (-0.38, -np.tanh(19.0))]
)
def test_the_rounded_sign(speed: float, sign: float) -> None:
    assert smooth_sign(speed, 0.02) == pytest.approx(sign, abs=1e-12)


def test_the_slider_of_a_hysteresis_adds_its_torque_by_its_loading() -> None:
    p = flat_values(TWO_MASS, {"shaft_hysteresis": {"friction_nm": 30.0}})
    assert [shaft_torque(0.0, 0.0, p, loading) for loading in (-1.0, 0.0, 0.5)] == [-30.0, 0.0, 15.0]


@pytest.mark.parametrize(("loading", "rate"), [(1.0, 2.0), (-1.0, -2.0), (0.3, 0.0)])
def test_a_slider_that_slides_or_rests_loads_no_further(loading: float, rate: float) -> None:
    assert loading_rate(loading, rate / 1e-3, 1.0, 1.0, 600.0) == 0.0


def test_a_slider_loads_by_the_twist_and_not_by_time() -> None:
    slow, fast = (loading_rate(0.2, rate / 0.05, 1.0, 1.0, 1e9) for rate in (0.1, 1.0))
    assert fast == pytest.approx(10.0 * slow)
    assert slow == pytest.approx((0.1 - 0.1 * 0.2) / 0.05)
    assert loading_rate(0.2, -0.1 / 0.05, 1.0, 1.0, 1e9) == pytest.approx((-0.1 - 0.1 * 0.2) / 0.05)
    assert loading_rate(0.2, 1.0 / 1e-9, 1.0, 1.0, 600.0) == pytest.approx(600.0 * 0.8)


def test_a_sharp_slider_holds_longer_and_may_come_back_elastically() -> None:
    """n = 2 yields by z^2; u = 0 unloads with the stiffness of the start (Bouc-Wen with equal coefficients)."""
    assert loading_rate(0.5, 1.0 / 0.1, 2.0, 0.0, 1e9) == pytest.approx((1.0 - 0.25) / 0.1)
    assert loading_rate(0.5, -1.0 / 0.1, 2.0, 0.0, 1e9) == pytest.approx(-1.0 / 0.1)


@pytest.mark.parametrize(("share", "inertia"), [(0.0, 2.0), (1.0, 8.0), (0.5, 3.2)])
def test_an_inertia_for_part_of_the_time_is_the_harmonic_mean(share: float, inertia: float) -> None:
    assert inertia_while(2.0, 6.0, share) == pytest.approx(inertia)  # half the time each: 2 / (1/2 + 1/8)


@pytest.mark.parametrize(
    ("low", "high", "share"), [(0.0, 9.0, 1.0), (2.0, 9.0, 0.0), (1.25, 9.0, 0.75), (1.25, 1.5, 0.25), (0.0, 1.5, 0.5)]
)
def test_how_much_of_a_step_lies_in_an_event(low: float, high: float, share: float) -> None:
    assert share_inside(1.0, 1.0, low, high) == pytest.approx(share)
