"""Effects between the torque's reading and the shaft, against the reference and closed formulas."""

import numpy as np
import pytest

from estimator.physics.inputs import shaft_torque
from estimator.physics.layout import flat_values
from estimator.signals.record import FloatArray
from tests.estimator.physics import reference
from tests.estimator.physics.bench import SAMPLE_TIME_S, TWO_MASS, random_steps
from tests.estimator.physics.law_bench import (
    SAMPLES,
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
from tests.estimator.physics.reference import Held

BOTH = np.column_stack([random_steps(SAMPLES, seed=3, size_nm=70.0), random_steps(SAMPLES, seed=4, size_nm=40.0)])


def held(torque_nm: FloatArray) -> Held:
    return Held.of(torque_nm, SAMPLE_TIME_S)


def supplied(torque_nm: FloatArray, **effects: dict[str, float]) -> FloatArray:
    return shaft_torque(torque_nm, TIME_S, flat_values(TWO_MASS, effects))


@pytest.mark.parametrize(("gain_m1", "gain_m2"), [(0.9, 1.0), (1.0, 1.2), (1.1, 0.8)])
def test_a_gain_scales_the_reading_of_its_inverter(gain_m1: float, gain_m2: float) -> None:
    effects = {"inverter_gain_mismatch": {"gain_m1": gain_m1, "gain_m2": gain_m2}}
    expected = solved(two_mass(), held=held(gain_m1 * BOTH[:, 0] + gain_m2 * BOTH[:, 1]))
    assert_law(effects, expected, measured(torque_nm=BOTH))


def knee(torque_nm: FloatArray, limit_nm: float, sharpness: float) -> FloatArray:
    """A torque that nears its limit, written down as the entry has it."""
    return np.asarray(torque_nm / (1.0 + np.abs(torque_nm / limit_nm) ** sharpness) ** (1.0 / sharpness))


def edge(torque_nm: FloatArray, limit_nm: float) -> FloatArray:
    return np.clip(torque_nm, -limit_nm, limit_nm)


M1, M2 = BOTH.T
SATURATED: dict[str, tuple[dict[str, float], FloatArray]] = {
    "each": ({"limit_m1_nm": 50.0, "limit_m2_nm": 35.0}, edge(M1, 50.0) + edge(M2, 35.0)),
    "one": ({"limit_m1_nm": 50.0}, edge(M1, 50.0) + M2),
    "the_other": ({"limit_m2_nm": 20.0}, M1 + edge(M2, 20.0)),
    "sum": ({"limit_sum_nm": 60.0}, edge(M1 + M2, 60.0)),
    "both": ({"limit_m1_nm": 50.0, "limit_sum_nm": 60.0}, edge(edge(M1, 50.0) + M2, 60.0)),
    "knee": ({"limit_m1_nm": 50.0, "sharpness": 4.0}, knee(M1, 50.0, 4.0) + M2),
    "knee_of_the_sum": ({"limit_sum_nm": 60.0, "sharpness": 6.0}, knee(M1 + M2, 60.0, 6.0)),
}


@pytest.mark.parametrize("name", SATURATED)
def test_saturation_cuts_each_inverter_and_then_the_sum(name: str) -> None:
    limits, expected = SATURATED[name]
    np.testing.assert_allclose(supplied(BOTH, torque_saturation=limits), expected)
    assert_law({"torque_saturation": limits}, solved(two_mass(), held=held(expected)), measured(torque_nm=BOTH))


@pytest.mark.parametrize(("depth", "since_s"), [(0.3, 0.0), (-0.1, 0.0), (0.3, 1.1)])
def test_derating_lets_the_torque_fall_towards_its_depth(depth: float, since_s: float) -> None:
    """From a cold start, or for some time already when the recording begins."""
    tau = 0.8
    left = 1.0 - depth * (1.0 - np.exp(-(TIME_S + since_s) / tau))
    warm = 1.0 - float(np.exp(-since_s / tau))
    effects = {"torque_derating": {"depth": depth, "time_constant_s": tau, "warm": warm}}
    np.testing.assert_allclose(supplied(TORQUE[:, None], **effects), TORQUE * left, rtol=1e-12)
    assert_law(effects, solved(two_mass(), held=held(TORQUE * left)))


def test_the_torque_path_acts_in_the_order_gain_limit_derating() -> None:
    effects = {
        "inverter_gain_mismatch": {"gain_m1": 1.5},
        "torque_saturation": {"limit_m1_nm": 80.0, "limit_m2_nm": 80.0, "limit_sum_nm": 100.0},
        "torque_derating": {"depth": 0.4, "time_constant_s": 0.5},
    }
    each = np.clip(BOTH * [1.5, 1.0], -80.0, 80.0)
    total = np.clip(each.sum(axis=1), -100.0, 100.0)
    np.testing.assert_allclose(supplied(BOTH, **effects), total * (1.0 - 0.4 * (1.0 - np.exp(-TIME_S / 0.5))))


@pytest.mark.parametrize("tau", [0.004, 0.05])
def test_a_lag_is_one_more_state(tau: float) -> None:
    line = two_mass()

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        return np.append(line(t, x[:4], x[4]), (torque - x[4]) / tau)

    start = np.append(start_vector(), TORQUE[0])
    expected = reference.solve(rhs, start, held(TORQUE), TIME_S)[:, reference.SPEED]
    assert_law({"actuator_lag": {"time_constant_s": tau}}, expected)


@pytest.mark.parametrize("shape", [0.02, 0.25, 0.5])
def test_a_lag_of_second_order_is_two_more(shape: float) -> None:
    line, tau = two_mass(), 0.03

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        lacking = torque - x[4] - tau * x[5]
        return np.append(line(t, x[:4], x[4]), [x[5], lacking / (shape * tau**2)])

    start = np.append(start_vector(), [TORQUE[0], 0.0])
    expected = reference.solve(rhs, start, held(TORQUE), TIME_S)[:, reference.SPEED]
    assert_law({"actuator_lag": {"time_constant_s": tau, "shape": shape}}, expected)


@pytest.mark.parametrize("delay_s", [0.03, 0.0137, 0.0502])
def test_a_delay_shifts_the_torque(delay_s: float) -> None:
    expected = solved(two_mass(), held=Held.of(TORQUE, SAMPLE_TIME_S, late_s=delay_s))
    assert_law({"transport_delay": {"delay_s": delay_s}}, expected)


@pytest.mark.parametrize("rate", [0.02, -0.02])
def test_a_drifting_clock_stretches_the_torque(rate: float) -> None:
    expected = solved(two_mass(), held=Held.of(TORQUE, SAMPLE_TIME_S, pace=1.0 + rate))
    assert_law({"clock_drift": {"rate": rate}}, expected, tolerance=2e-4)


OVERTONE = {"overtone_in_step": 0.3 * np.cos(0.5), "overtone_across": 0.3 * np.sin(0.5)}


def _pulsating(angle: FloatArray | float) -> FloatArray:
    """A wave with an overtone of three tenths of its size, half a radian of its own turn late."""
    return np.asarray(np.cos(angle) + 0.3 * np.cos(2.0 * np.asarray(angle) - 0.5))


@pytest.mark.parametrize("order", [1.0, 6.0])
def test_a_ripple_follows_the_measured_angle(order: float) -> None:
    """The reading is a known speed, so that the angle is known: the phase comes from it and not from the fit."""
    turning = 8.0 + 3.0 * np.sin(1.7 * TIME_S)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * SAMPLE_TIME_S * (turning[1:] + turning[:-1]))])
    line = two_mass(ripple=lambda t: 25.0 * _pulsating(order * np.interp(t, TIME_S, angle) + 0.7))
    effects = {"torque_ripple": {"amplitude_nm": 25.0, "order": order, "phase_rad": 0.7} | OVERTONE}
    assert_law(effects, solved(line), measured(turning))


def test_a_lag_acts_behind_a_delay_and_before_the_ripple() -> None:
    """Only what passes through the inverter lags; the ripple arises in the air gap."""
    tau, delay_s = 0.03, 0.02
    line = two_mass(ripple=lambda t: 25.0 * np.cos(60.0 * t))

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        return np.append(line(t, x[:4], x[4]), (torque - x[4]) / tau)

    late = Held.of(TORQUE, SAMPLE_TIME_S, late_s=delay_s)
    expected = reference.solve(rhs, np.append(start_vector(), TORQUE[0]), late, TIME_S)[:, reference.SPEED]
    effects = {
        "actuator_lag": {"time_constant_s": tau},
        "transport_delay": {"delay_s": delay_s},
        "torque_ripple": {"amplitude_nm": 25.0, "order": 6.0, "phase_rad": 0.0},
    }
    rec = measured(np.full(SAMPLES, 10.0))
    assert_same(kernel_output(effects, rec), expected, kernel_output({}, rec))
