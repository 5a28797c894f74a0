"""Effects of the speed sensor, against the reference."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.kernel import sensing, state_vector
from estimator.physics.layout import Grid, flat_values
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, Location, OutputKind
from tests.estimator.physics import reference
from tests.estimator.physics.bench import SAMPLE_TIME_S, TWO_MASS, assert_same_to_rounding, model
from tests.estimator.physics.law_bench import (
    SIGN_WIDTH,
    START,
    SUBSTEPS,
    TIME_S,
    TORQUE,
    assert_law,
    kernel_output,
    measured,
    solved,
    start_vector,
    two_mass,
)
from tests.estimator.physics.reference import Held

TURNING = 12.0 + 5.0 * np.cos(2.1 * TIME_S)
TURNED = np.concatenate([[0.0], np.cumsum(0.5 * SAMPLE_TIME_S * (TURNING[1:] + TURNING[:-1]))])
RESOLVER = {"once_rad": 0.02, "twice_rad": 0.03, "once_phase_rad": 0.3, "twice_phase_rad": -0.8}


def true_speed() -> FloatArray:
    return solved(two_mass())


def read_by_resolver(speed: FloatArray, read: FloatArray) -> FloatArray:
    """The read angle's slope: d/dt of phi + e_1 sin(phi + a_1) + e_2 sin(2 phi + a_2), where that is what is read."""
    angle = read
    for _ in range(40):  # the error changes by less than 0.08 per radian: each time a twelfth of what was off
        angle = read - 0.02 * np.sin(angle + 0.3) - 0.03 * np.sin(2.0 * angle - 0.8)
    error = 0.02 * np.cos(angle + 0.3) + 2.0 * 0.03 * np.cos(2.0 * angle - 0.8)
    return np.asarray(speed * (1.0 + error))


def test_a_resolver_errs_once_and_twice_per_measured_turn() -> None:
    assert_law({"resolver_error": RESOLVER}, read_by_resolver(true_speed(), TURNED), measured(TURNING))


def test_the_read_angle_is_off_by_the_amplitudes_reported() -> None:
    """The reading of a constant speed, summed up, is the angle with e_1 once and e_2 twice per turn."""
    speed = 2.0 * np.pi
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)
    p = flat_values(TWO_MASS, {"resolver_error": {"once_rad": 0.02, "twice_rad": 0.03}})
    read = np.array([sensing.reading(speed, sensing.read_angle(phi, p), p) for phi in angle])
    step = np.diff(angle) * 0.5 * (read[1:] + read[:-1]) / speed
    off = np.concatenate([[0.0], np.cumsum(step)]) - angle
    np.testing.assert_allclose(off, 0.02 * np.sin(angle) + 0.03 * np.sin(2.0 * angle), atol=1e-6)


@pytest.mark.parametrize("tau", [0.004, 0.03])
def test_a_filter_is_one_more_state_that_the_line_does_not_feel(tau: float) -> None:
    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        return np.append(two_mass()(t, x[:4], torque), (x[reference.SPEED] - x[4]) / tau)

    start = np.append(start_vector(), START.speed_rad_s)
    expected = reference.solve(rhs, start, Held.of(TORQUE, SAMPLE_TIME_S), TIME_S)[:, 4]
    assert_law({"speed_filter": {"time_constant_s": tau}}, expected)


@pytest.mark.parametrize("shape", [0.02, 0.25, 0.5])
def test_a_filter_of_second_order_is_two_more(shape: float) -> None:
    tau = 0.03

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        value, rate = x[4], x[5]
        lacking = x[reference.SPEED] - value - tau * rate
        return np.append(two_mass()(t, x[:4], torque), [rate, lacking / (shape * tau**2)])

    start = np.append(start_vector(), [START.speed_rad_s, 0.0])
    expected = reference.solve(rhs, start, Held.of(TORQUE, SAMPLE_TIME_S), TIME_S)[:, 4]
    assert_law({"speed_filter": {"time_constant_s": tau, "shape": shape}}, expected)


def test_a_filter_whose_second_pole_is_far_away_is_of_first_order() -> None:
    first = kernel_output({"speed_filter": {"time_constant_s": 0.03}}, measured())
    second = kernel_output({"speed_filter": {"time_constant_s": 0.03, "shape": 1e-9}}, measured())
    np.testing.assert_allclose(second, first, atol=1e-7)


@pytest.mark.parametrize("share", [1.0, 0.4])
def test_a_sensor_blind_for_the_sign_reads_the_magnitude(share: float) -> None:
    speed = true_speed()
    assert speed.min() < -0.5
    assert_law({"speed_sign_blind": {"share": share}}, (1.0 - share) * speed + share * np.abs(speed))


def test_a_quantised_speed_is_the_nearest_step() -> None:
    """Where simulation and reference lie on two sides of an edge they are a step apart; almost nowhere else."""
    out = kernel_output({"speed_quantisation": {"step_rad_s": 0.25}}, measured())
    expected = 0.25 * np.round(true_speed() / 0.25)
    same = np.isclose(out, expected, atol=1e-12)
    assert same.mean() > 0.98
    np.testing.assert_allclose(np.abs(out - expected)[~same], 0.25, rtol=1e-9)
    assert np.max(np.abs(out - true_speed())) > 0.1


def test_a_reading_passes_resolver_filter_magnitude_and_steps_in_this_order() -> None:
    tau = 0.03

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        angle = np.interp(t, TIME_S, TURNED)
        read = read_by_resolver(x[reference.SPEED], angle)
        return np.append(two_mass()(t, x[:4], torque), (read - x[4]) / tau)

    start = np.append(start_vector(), read_by_resolver(np.float64(START.speed_rad_s), np.float64(0.0)))
    filtered = reference.solve(rhs, start, Held.of(TORQUE, SAMPLE_TIME_S), TIME_S)[:, 4]
    effects = {
        "resolver_error": RESOLVER,
        "speed_filter": {"time_constant_s": tau},
        "speed_sign_blind": {"share": 1.0},
        "speed_quantisation": {"step_rad_s": 0.25},
    }
    out = kernel_output(effects, measured(TURNING))
    assert np.isclose(out, 0.25 * np.round(np.abs(filtered) / 0.25), atol=1e-12).mean() > 0.98
    without_order = 0.25 * np.round(np.abs(read_by_resolver(true_speed(), TURNED)) / 0.25)
    assert np.isclose(out, without_order, atol=1e-12).mean() < 0.8


def test_a_measured_position_does_not_pass_the_speed_sensor() -> None:
    rec = replace(measured(TIME_S), kind=OutputKind.POSITION)
    effects = {"speed_filter": {"time_constant_s": 0.05}, "speed_sign_blind": {"share": 1.0}}
    assert_same_to_rounding(kernel_output(effects, rec), kernel_output({}, rec))


def test_a_state_asked_for_is_the_true_one() -> None:
    grid = Grid(model(TWO_MASS).structure, SUBSTEPS, SIGN_WIDTH)
    p = flat_values(TWO_MASS, {"speed_filter": {"time_constant_s": 0.05}})
    out = simulate(grid, measured(), p, START, output=state_vector.SPEED)
    assert_same_to_rounding(out, kernel_output({}, measured()))


@pytest.mark.parametrize("location", [Location.MOTOR, Location.LOAD])
def test_a_jittering_sample_is_the_output_at_its_own_instant(location: Location) -> None:
    """To first order in the jitter: what is left falls with its square."""
    state = reference.SPEED if location is Location.MOTOR else reference.LOAD_SPEED
    left = []
    for size_s in (2e-3, 1e-3):
        offset_s = size_s * np.random.default_rng(5).uniform(-1.0, 1.0, TIME_S.size)
        offset_s[0] = 0.0
        instants_s = TIME_S + offset_s
        states = reference.solve(two_mass(), start_vector(), Held.of(TORQUE, SAMPLE_TIME_S), instants_s)
        rec = replace(measured(), offset_s=offset_s, location=location)
        plain = replace(rec, offset_s=None)
        left.append(np.sqrt(np.mean((kernel_output({}, rec) - states[:, state]) ** 2)))
        assert left[-1] < 0.2 * np.sqrt(np.mean((kernel_output({}, plain) - states[:, state]) ** 2))
    assert left[1] < 0.35 * left[0]
