"""Effects at the load, against the reference."""

from collections.abc import Callable

import numpy as np
import pytest

from estimator.physics.effects.load import KNOT_SPACING_S, grade_basis
from estimator.signals.record import FloatArray
from tests.estimator.physics import reference
from tests.estimator.physics.bench import SAMPLE_TIME_S, TWO_MASS
from tests.estimator.physics.law_bench import (
    SIGN_WIDTH,
    START,
    TIME_S,
    TORQUE,
    assert_law,
    assert_same,
    kernel_output,
    measured,
    solved,
    start_vector,
    two_mass,
)
from tests.estimator.physics.reference import Held, lasting

BRAKED_S = (0.5037, 1.7012)


def sign(speed: float) -> float:
    """The sign of a speed as the kernel rounds it."""
    return float(np.tanh(speed / SIGN_WIDTH))


def test_dry_friction_at_the_load_is_against_the_loads_motion() -> None:
    line = two_mass(drag=lambda t, w: 30.0 * sign(w))
    assert_law({"coulomb_friction_load": {"friction_nm": 30.0}}, solved(line))


def against_bristles(held_nm: Callable[[float], float], presliding_rad: float) -> FloatArray:
    """Solve a load held by bristles, one more state: dT/dt = s (w - |w| T / T_c), s = T_c / x_b.

    They are described by their deflection: T = T_c z / x_b, dz/dt = w - |w| z / x_b. A brake begins with straight ones.
    """

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        w, deflection = x[reference.LOAD_SPEED], x[4]
        line = two_mass(drag=lambda t, w: held_nm(t) * deflection / presliding_rad)
        bending = w - abs(w) * deflection / presliding_rad if held_nm(t) > 0.0 else 0.0
        return np.append(line(t, x[:4], torque), bending)

    torque = Held.of(TORQUE, SAMPLE_TIME_S)
    start = np.append(start_vector(), presliding_rad if held_nm(0.0) > 0.0 else 0.0)
    return reference.solve(rhs, start, torque, TIME_S, BRAKED_S)[:, reference.SPEED]


def test_dry_friction_at_the_load_deflects_before_it_slides() -> None:
    effects = {"coulomb_friction_load": {"friction_nm": 30.0, "presliding_rad": 0.02}}
    expected = against_bristles(lambda t: 30.0, 0.02)
    assert_law(effects, expected, tolerance=3e-4)
    rigid = kernel_output({"coulomb_friction_load": {"friction_nm": 30.0}}, measured())
    assert np.max(np.abs(rigid - expected)) > 2e-3 * np.ptp(expected)


def test_air_drag_grows_with_the_square_of_the_loads_speed() -> None:
    line = two_mass(drag=lambda t, w: 15.0 * w * abs(w))
    assert_law({"aerodynamic_drag": {"drag_nm_s2": 15.0}}, solved(line))


@pytest.mark.parametrize(("from_s", "to_s"), [(0.5, 1.6), (0.5037, 1.7012), (0.9, 9.0)])
def test_a_dragging_brake_is_dry_friction_for_a_while(from_s: float, to_s: float) -> None:
    torque = lasting(60.0, from_s, to_s)
    line = two_mass(drag=lambda t, w: torque(t) * sign(w))
    effects = {"brake_drag": {"brake_nm": 60.0, "from_s": from_s, "to_s": to_s}}
    assert_law(effects, solved(line, (from_s, to_s)), tolerance=3e-4)


@pytest.mark.parametrize("change", [-25.0, 60.0])
@pytest.mark.parametrize(("from_s", "to_s"), [(0.5037, 1.7012), (0.9, 9.0)])
def test_a_payload_changes_the_loads_inertia(change: float, from_s: float, to_s: float) -> None:
    line = two_mass(more_load=lasting(change, from_s, to_s))
    effects = {"inertia_change": {"change_kg_m2": change, "from_s": from_s, "to_s": to_s}}
    assert_law(effects, solved(line, (from_s, to_s)), tolerance=3e-4)


@pytest.mark.parametrize("since_s", [0.0, 0.5])
def test_warming_oil_loses_viscous_friction(since_s: float) -> None:
    """From cold, or for some time already when the recording begins."""
    cold, tau = 25.0, 0.7
    line = two_mass(drag=lambda t, w: cold * np.exp(-(t + since_s) / tau) * w)
    warm = 1.0 - float(np.exp(-since_s / tau))
    assert_law({"warming_friction": {"cold_nm_s": cold, "time_constant_s": tau, "warm": warm}}, solved(line))


@pytest.mark.parametrize("motor_turns", [1.0, 3.3])
def test_an_unbalanced_oval_wheel_swings_the_load_once_and_twice_per_its_turn(motor_turns: float) -> None:
    turning = 15.0 + 6.0 * np.cos(2.1 * TIME_S)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * SAMPLE_TIME_S * (turning[1:] + turning[:-1]))])

    def heavy_and_oval(t: float, w: float) -> float:
        wheel = float(np.interp(t, TIME_S, angle)) / motor_turns
        return 40.0 * np.cos(wheel + 1.1) + 8.0 * np.sin(2.0 * (wheel + 1.1))

    line = two_mass(drag=heavy_and_oval)
    values = {"amplitude_nm": 40.0, "motor_turns_per_turn": motor_turns, "phase_rad": 1.1, "overtone_across": 0.2}
    assert_law({"load_imbalance": values}, solved(line), measured(turning))


@pytest.mark.parametrize(("slip", "share", "creep"), [(2e-3, 0.1, 2.0), (5e-4, 0.4, 5.0)])
def test_a_slipping_tyre_couples_wheel_and_vehicle_by_creep(slip: float, share: float, creep: float) -> None:
    """The wheel has a share of J_L, the vehicle the rest; its own drag and the road's load act on the vehicle."""
    v = TWO_MASS

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        _, w_M, twist, w_W, w_V = x
        T_S = v["k"] * twist + v["c"] * (w_M - w_W)
        T_x = (w_W - w_V) / (slip * (abs(w_V) + creep))
        drag = v["b_L"] * w_V + START.load_torque_nm
        return np.array(
            [
                w_M,
                (torque - v["b_M"] * w_M - T_S) / v["J_M"],
                w_M - w_W,
                (T_S - T_x) / (share * v["J_L"]),
                (T_x - drag) / ((1.0 - share) * v["J_L"]),
            ]
        )

    start = np.append(start_vector(), START.load_speed_rad_s)
    expected = reference.solve(rhs, start, Held.of(TORQUE, SAMPLE_TIME_S), TIME_S)[:, reference.SPEED]
    values = {"slip_per_nm": slip, "wheel_share": share, "creep_rad_s": creep}
    assert_law({"tyre_slip": values}, expected)


@pytest.mark.parametrize(("slip", "roll", "grip"), [(2e-3, 0.5, np.inf), (5e-4, 3.0, np.inf), (5e-4, 3.0, 90.0)])
def test_the_traction_of_a_tyre_may_build_up_as_it_rolls_and_ends_where_it_slides(
    slip: float, roll: float, grip: float
) -> None:
    v, share, creep, carcass_s = TWO_MASS, 0.15, 2.0, 0.01

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        _, w_M, twist, w_W, w_V, T_l = x
        T_S = v["k"] * twist + v["c"] * (w_M - w_W)
        T_x = T_l + carcass_s / (slip * roll) / (1.0 + (w_V / creep) ** 2) * (w_W - w_V)
        T_x = grip * np.tanh(T_x / grip) if np.isfinite(grip) else T_x
        drag = v["b_L"] * w_V + START.load_torque_nm
        return np.array(
            [
                w_M,
                (torque - v["b_M"] * w_M - T_S) / v["J_M"],
                w_M - w_W,
                (T_S - T_x) / (share * v["J_L"]),
                (T_x - drag) / ((1.0 - share) * v["J_L"]),
                ((w_W - w_V) / slip - abs(w_V) * T_l) / roll,
            ]
        )

    start = np.array([*start_vector(), START.load_speed_rad_s, START.load_torque_nm])  # it carries the constant load
    expected = reference.solve(rhs, start, Held.of(TORQUE, SAMPLE_TIME_S), TIME_S)[:, reference.SPEED]
    values = {"slip_per_nm": slip, "wheel_share": share, "creep_rad_s": creep, "relaxation_rad": roll}
    values |= {"carcass_s": carcass_s, "grip_nm": grip}
    assert_law({"tyre_slip": values}, expected)


def test_friction_brakes_the_wheel_and_air_the_vehicle() -> None:
    """Behind a slipping tyre the two loads act at different places."""
    v, slip, share, creep = TWO_MASS, 2e-3, 0.2, 2.0

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        _, w_M, twist, w_W, w_V = x
        T_S = v["k"] * twist + v["c"] * (w_M - w_W)
        T_x = (w_W - w_V) / (slip * (abs(w_V) + creep))
        drag = v["b_L"] * w_V + 15.0 * w_V * abs(w_V) + START.load_torque_nm
        return np.array(
            [
                w_M,
                (torque - v["b_M"] * w_M - T_S) / v["J_M"],
                w_M - w_W,
                (T_S - T_x - 30.0 * sign(w_W)) / (share * v["J_L"]),
                (T_x - drag) / ((1.0 - share) * v["J_L"]),
            ]
        )

    start = np.append(start_vector(), START.load_speed_rad_s)
    expected = reference.solve(rhs, start, Held.of(TORQUE, SAMPLE_TIME_S), TIME_S)[:, reference.SPEED]
    tyre = {"slip_per_nm": slip, "wheel_share": share, "creep_rad_s": creep}
    effects = {
        "tyre_slip": tyre,
        "coulomb_friction_load": {"friction_nm": 30.0},
        "aerodynamic_drag": {"drag_nm_s2": 15.0},
    }
    assert_same(kernel_output(effects, measured()), expected, kernel_output({"tyre_slip": tyre}, measured()))


class TestRoadGradeBasis:
    TIME_S = np.arange(2001) * 0.01

    def test_with_the_first_spline_they_would_sum_to_one(self) -> None:
        """A cubic B-spline over [0, d] that starts the partition of unity is (1 - t/d)^3."""
        first = np.maximum(1.0 - self.TIME_S / KNOT_SPACING_S, 0.0) ** 3
        np.testing.assert_allclose(grade_basis(self.TIME_S).sum(axis=0) + first, 1.0, atol=1e-12)

    def test_with_a_constant_it_reproduces_every_cubic(self) -> None:
        t = self.TIME_S / 20.0
        design = np.vstack([np.ones_like(t), grade_basis(self.TIME_S)]).T
        cubic = 3.0 - 2.0 * t + 5.0 * t**2 - 4.0 * t**3
        left = cubic - design @ np.linalg.lstsq(design, cubic, rcond=None)[0]
        np.testing.assert_allclose(left, 0.0, atol=1e-10)

    def test_a_smooth_road_is_followed_and_a_step_is_not(self) -> None:
        design = np.vstack([np.ones_like(self.TIME_S), grade_basis(self.TIME_S)]).T
        hill = np.sin(2 * np.pi * self.TIME_S / 15.0)
        step = np.where(self.TIME_S > 9.0, 1.0, -1.0)
        left = [profile - design @ np.linalg.lstsq(design, profile, rcond=None)[0] for profile in (hill, step)]
        assert np.sqrt(np.mean(left[0] ** 2)) < 5e-3
        assert np.sqrt(np.mean(left[1] ** 2)) > 0.1
