"""Effects in the shaft, against the reference."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.signals.record import FloatArray, Location
from tests.estimator.physics import reference
from tests.estimator.physics.bench import SAMPLE_TIME_S, TWO_MASS
from tests.estimator.physics.law_bench import (
    SAMPLES,
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

K, C = TWO_MASS["k"], TWO_MASS["c"]


@pytest.mark.parametrize("pull", [0.0, 0.6, 1.0])
def test_backlash_is_a_spring_and_a_damper_beyond_the_gap(pull: float) -> None:
    gap, depth = 0.02, 2e-3

    def shaft(t: float, twist: float, rate: float) -> float:
        beyond = np.sign(twist) * max(abs(twist) - 0.5 * gap, 0.0)
        torque = float(K * beyond + C * (1.0 - np.exp(-abs(beyond) / depth)) * rate)
        return torque * (1.0 if torque * beyond > 0.0 else pull)

    effects = {"backlash": {"gap_rad": gap, "contact_rad": depth, "pull": pull}}
    assert_law(effects, solved(two_mass(shaft=shaft)), tolerance=3e-4)


@pytest.mark.parametrize(("hardening", "shape"), [(900.0, 1.0), (900.0, 2.0), (-600.0, 0.5)])
def test_the_stiffness_changes_with_the_twist(hardening: float, shape: float) -> None:
    power = shape if hardening > 0 else -shape

    def shaft(t: float, twist: float, rate: float) -> float:
        return float(K * twist * (1.0 + abs(hardening) * twist**2 / shape) ** power + C * rate)

    effects = {"stiffness_nonlinearity": {"hardening_per_rad2": hardening, "shape": shape}}
    assert_law(effects, solved(two_mass(shaft=shaft)))


@pytest.mark.parametrize("share", [0.5, -0.4])
def test_a_second_stage_is_loaded_from_a_twist_on(share: float) -> None:
    begins = 0.01

    def shaft(t: float, twist: float, rate: float) -> float:
        return float(K * (twist + share * np.sign(twist) * max(abs(twist) - begins, 0.0)) + C * rate)

    stages = {"hardening_per_rad2": 0.0, "stage_share": share, "stage_rad": begins}
    assert_law({"stiffness_nonlinearity": stages}, solved(two_mass(shaft=shaft)))


@pytest.mark.parametrize(("from_s", "to_s"), [(0.5, 1.6), (0.5037, 1.7012), (0.9, 9.0)])
def test_a_crack_takes_stiffness_from_a_moment_on(from_s: float, to_s: float) -> None:
    lost = lasting(-0.3, from_s, to_s)
    line = two_mass(shaft=lambda t, twist, rate: K * (1.0 + lost(t)) * twist + C * rate)
    effects = {"stiffness_change": {"change": -0.3, "from_s": from_s, "to_s": to_s}}
    assert_law(effects, solved(line, (from_s, to_s)), tolerance=3e-4)


def test_hysteresis_is_a_slider_next_to_the_spring() -> None:
    friction, give = 25.0, 5e-3

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        line = two_mass(shaft=lambda t, twist, rate: K * twist + C * rate + friction * x[4])
        rate = x[reference.SPEED] - x[reference.LOAD_SPEED]
        return np.append(line(t, x[:4], torque), (rate - abs(rate) * x[4]) / give)

    held = Held.of(TORQUE, SAMPLE_TIME_S)
    expected = reference.solve(rhs, np.append(start_vector(), 0.0), held, TIME_S)[:, reference.SPEED]
    assert_law({"shaft_hysteresis": {"friction_nm": friction, "yield_rad": give}}, expected)


def test_cardan_joints_turn_the_shaft_twice_per_measured_turn() -> None:
    turning = 9.0 + 4.0 * np.cos(2.1 * TIME_S)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * SAMPLE_TIME_S * (turning[1:] + turning[:-1]))])

    def shaft(t: float, twist: float, rate: float) -> float:
        return float(K * twist + C * rate + 20.0 * np.cos(2.0 * np.interp(t, TIME_S, angle) - 0.4))

    effects = {"cardan_second_order": {"amplitude_nm": 20.0, "phase_rad": -0.4}}
    assert_law(effects, solved(two_mass(shaft=shaft)), measured(turning))


def test_cardan_joints_may_twist_the_shaft_by_their_angle() -> None:
    """The phase is the measured angle's, the rate is the motor's own speed; the motor feels the joint's power."""
    size = 5e-3

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        angle = 2.0 * 10.0 * t - 0.4
        bent = size * np.cos(angle)
        slope = -2.0 * size * np.sin(angle)
        turning = slope * x[reference.SPEED]
        carried: list[float] = []

        def shaft(t: float, twist: float, rate: float) -> float:
            carried.append(K * (twist + bent) + C * (rate + turning))
            return carried[-1]

        rates = two_mass(shaft=shaft)(t, x, torque)
        rates[reference.SPEED] -= slope * carried[-1] / TWO_MASS["J_M"]
        return rates

    effects = {"cardan_second_order": {"angle_rad": size, "angle_phase_rad": -0.4}}
    assert_law(effects, solved(rhs), measured(np.full(SAMPLES, 10.0)))


@pytest.mark.parametrize("frequency_hz", [4.0, 9.0, 25.0])
def test_an_extra_mode_is_an_inertia_on_a_spring_at_the_motor(frequency_hz: float) -> None:
    inertia, ratio = 0.4, 0.06
    k_X = inertia * (2.0 * np.pi * frequency_hz) ** 2
    c_X = 2.0 * ratio * np.sqrt(k_X * inertia)

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        twist, rate = x[reference.ANGLE] - x[4], x[reference.SPEED] - x[5]
        spring = k_X * twist + c_X * rate
        return np.concatenate([two_mass()(t, x[:4], torque - spring), [x[5], spring / inertia]])

    start = np.concatenate([start_vector(), [0.0, start_vector()[reference.SPEED]]])
    held = Held.of(TORQUE, SAMPLE_TIME_S)
    expected = reference.solve(rhs, start, held, TIME_S)[:, reference.SPEED]
    values = {"inertia_kg_m2": inertia, "frequency_hz": frequency_hz, "damping_ratio": ratio}
    assert_law({"extra_torsional_mode": values}, expected)


@pytest.mark.parametrize("location", [Location.MOTOR, Location.LOAD])
@pytest.mark.parametrize("share", [0.6, 0.9])
@pytest.mark.parametrize("place", ["between_kg_m2", "behind_kg_m2"])
def test_an_inertia_within_the_line_is_on_the_spring_that_softens_the_shaft(
    place: str, share: float, location: Location
) -> None:
    inertia, ratio = 0.3, 0.04
    k_X = K * share / (1.0 - share)
    c_X = 2.0 * ratio * np.sqrt(k_X * inertia)
    at_motor = place == "between_kg_m2"

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        """Return the rates of motor, shaft and load, of the twist of the other spring, and of the inertia."""
        motor, load, inner = x[reference.SPEED], x[reference.LOAD_SPEED], x[5]
        shaft = inner - load if at_motor else motor - inner
        companion = motor - inner if at_motor else inner - load
        through_shaft, through_spring = K * x[reference.TWIST] + C * shaft, k_X * x[4] + c_X * companion
        taken, given = (through_spring, through_shaft) if at_motor else (through_shaft, through_spring)
        of_motor = (torque - TWO_MASS["b_M"] * motor - taken) / TWO_MASS["J_M"]
        of_load = (given - TWO_MASS["b_L"] * load - START.load_torque_nm) / TWO_MASS["J_L"]
        return np.array([motor, of_motor, shaft, of_load, companion, (taken - given) / inertia])

    carried = K * START.twist_rad / k_X
    start = np.concatenate([start_vector(), [carried, START.speed_rad_s if at_motor else START.load_speed_rad_s]])
    state = reference.SPEED if location is Location.MOTOR else reference.LOAD_SPEED
    expected = reference.solve(rhs, start, Held.of(TORQUE, SAMPLE_TIME_S), TIME_S)[:, state]
    values = {place: inertia, "line_share": share, "damping_ratio": ratio}
    rec = replace(measured(), location=location)
    assert_law({"extra_torsional_mode": values}, expected, rec)
    quick = {"extra_torsional_mode": values, "speed_filter": {"time_constant_s": 1e-5}}
    np.testing.assert_allclose(kernel_output(quick, rec)[1:], expected[1:], atol=2e-3 * np.ptp(expected))
