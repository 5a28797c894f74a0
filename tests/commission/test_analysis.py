"""What the steps compute, against signals whose answer is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimator.identification.modes.modes import two_mass_resonance
from estimator.identification.offline.fits import fit_output_error
from estimator.physics.simulate import Stepper
from estimator.signals.decimate import decimate
from estimator.signals.prbs import prbs_nm
from estimator.signals.record import Record
from hil.commission import prbs_design as amplitude
from hil.commission.physical_fit import fit_two_mass, select_delay
from hil.commission.prbs_design import Cap, resonance_spread, vibration_m_s2
from hil.commission.responses import Measured, pulse_response, response_ratio
from hil.commission.steps.models import validated
from hil.commission.steps.signs_scales import MOVES
from hil.config.rig_file import read_rig
from hil.orders.runner import margin_rad_s, rigid_model
from hil.plants import ModelPlant
from hil.report.comparison import compare_record
from hil.rig.experiments.laws import LEAD_S, Pulses
from hil.simulator.driveline import DEFAULT_BUS
from tests.commission.rigs import EXAMPLE

PERIOD_S = 0.01


def simulated(torque_nm: np.ndarray, name: str = "run", noise: float = 0.05, gain: float = 1.0) -> Record:
    """The default bus under a torque that reads so; ``gain`` of it acts."""
    vehicle = Stepper(DEFAULT_BUS, PERIOD_S, speed_rad_s=10.0)
    speed = np.empty(torque_nm.size)
    for k, torque in enumerate(torque_nm):
        speed[k] = vehicle.speed_rad_s
        vehicle.step(gain * torque, 0.0)
    speed += noise * np.random.default_rng(1).normal(size=speed.size)
    time_s = PERIOD_S * np.arange(speed.size)
    return Record(name, PERIOD_S, time_s, torque_nm[:, None], speed, np.ones(speed.size, dtype=bool))


def excited(n: int = 2000, level_nm: float = 60.0, **arguments: float) -> Record:
    return simulated(12.5 + prbs_nm(n, level_nm, clock_divider=2), **arguments)


NOISE_RAD_S = 0.05


def lagging(lag_s: float, seed: int) -> Record:
    """A run whose torque acts through a lag [s] that its reading does not show."""
    read = 12.5 + prbs_nm(2000, 60.0, clock_divider=2, seed=seed)
    left = math.exp(-PERIOD_S / lag_s) if lag_s else 0.0
    acting = lfilter([1.0 - left], [1.0, -left], read, zi=[left * 12.5])[0]
    return replace(simulated(acting, noise=NOISE_RAD_S), torque_nm=read[:, None])


def test_interval_on_both_sides_of_a_limit_tells_nothing() -> None:
    assert Measured(1.0, 0.1).is_within(0.5, 2.0) is True
    assert Measured(3.0, 0.1).is_within(0.5, 2.0) is False
    assert Measured(2.0, 0.1).is_within(0.5, 2.0) is None


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-0.115e-3, "0.115 ± 0.090 ms earlier"),
        (0.115e-3, "0.115 ± 0.090 ms later"),
        (-1e-9, "0.000 ± 0.090 ms earlier"),
    ],
)
def test_a_word_stands_for_the_sign(value: float, text: str) -> None:
    assert Measured(value, 0.09e-3).shown_as("later", "earlier", "ms", 1e3) == text


@pytest.mark.parametrize("factor", [1.0, -1.0, 0.3])
def test_pulses_tell_sign_and_size(factor: float) -> None:
    course = Pulses(18.0, 20.0, 1.0)
    reference = np.array([course.torque_nm(PERIOD_S * k) for k in range(1800)])
    impulse = np.concatenate([[0.0], np.cumsum(reference)[:-1]]) * PERIOD_S
    noise = 0.05 * np.random.default_rng(2).normal(size=impulse.size)
    speed = factor * impulse / 100.0 + 0.02 * np.arange(impulse.size) * PERIOD_S + noise
    found = pulse_response(reference, 0.99 * reference, speed, 100.0, PERIOD_S, 4, 400, round(LEAD_S / PERIOD_S))
    assert found.speed.value == pytest.approx(factor, abs=0.15)
    assert found.reading.value == pytest.approx(0.99, abs=1e-3)
    assert found.speed.exceeds(MOVES)


def test_creep_under_friction_has_no_direction() -> None:
    assert not Measured(-0.026, 0.020).exceeds(MOVES)


def test_a_run_that_begins_rolling_may_be_slowed_as_one_from_standstill() -> None:
    assert margin_rad_s(8.6, 9.3, 1.0) == margin_rad_s(0.0, 9.3, 1.0) == pytest.approx(0.25 * 9.3)
    assert margin_rad_s(-9.3, -8.6, 1.0) == pytest.approx(0.25 * 9.3)
    assert margin_rad_s(8.6, 9.3, 3.0) == 3.0


def test_gain_and_delay_between_two_tests() -> None:
    first, second = excited(), excited(gain=1.05)
    found = response_ratio(first, second)
    assert abs(found.gain.value - 1.05) < 2.0 * found.gain.ci95
    assert abs(found.delay_s.value) < 2.0 * found.delay_s.ci95
    later = Record("later", PERIOD_S, first.time_s, first.torque_nm, np.roll(second.output, 1), first.okay)
    shifted = response_ratio(first, later)
    assert shifted.delay_s.value == pytest.approx(PERIOD_S, abs=5e-4)


def test_without_coherence_nothing_is_determined() -> None:
    silent = simulated(np.full(2000, 12.5) + 0.001 * prbs_nm(2000, 1.0))
    assert response_ratio(silent, silent).gain.ci95 == math.inf


@pytest.mark.campaign
@pytest.mark.parametrize("extra", [0, 1, 3])
def test_delay_of_whole_samples_is_found(extra: int) -> None:
    record = excited()
    late = Record("late", PERIOD_S, record.time_s, record.torque_nm, np.roll(record.output, extra), record.okay)
    assert select_delay(late).extra_samples == extra


@pytest.mark.campaign
def test_spread_of_the_resonance_is_that_of_repeats() -> None:
    """The predicted standard deviation against the scatter of ten tests that differ in noise alone."""
    base = simulated(12.5 + prbs_nm(2000, 60.0, clock_divider=2), noise=0.0)
    predicted, found = [], []
    for seed in range(10):
        noise = 0.05 * np.random.default_rng(seed).normal(size=base.output.size)
        record = Record("run", PERIOD_S, base.time_s, base.torque_nm, base.output + noise, base.okay)
        spread = resonance_spread(fit_output_error(decimate(record, 1, 0.3)), (2.0, 25.0))
        assert spread is not None
        predicted.append(spread.frequency_std)
        found.append(spread.mode.frequency_hz)
    scatter = np.std(found, ddof=1) / np.mean(found)
    assert 0.4 < np.mean(predicted) / scatter < 2.5  # ten tests: a scatter of 24 %; a decade off would fail


def test_vibration_of_a_rigid_vehicle() -> None:
    """J dw/dt = T: a sine of 60 Nm on 100 kg m2 at 2 Hz is 0.6 / sqrt(2) rad/s2 RMS at the shaft."""
    time_s = PERIOD_S * np.arange(4000)
    omega = 2.0 * math.pi * 2.0
    torque, speed = 60.0 * np.cos(omega * time_s), 60.0 / 100.0 / omega * np.sin(omega * time_s)
    found = vibration_m_s2(torque, speed, rigid_model(read_rig(EXAMPLE)), PERIOD_S, 0.1)
    assert found == pytest.approx(0.1 * 0.6 / math.sqrt(2.0), rel=0.03)


def test_amplitude_serves_is_raised_or_is_held_down() -> None:
    cap = (Cap(150.0, "a limit"), Cap(200.0, "another"))
    assert amplitude.choose(120.0, 10.0, cap, 1.2).amplitude_nm == pytest.approx(120.0)
    raised = amplitude.choose(2.0, 10.0, cap, 1.2)
    assert (raised.amplitude_nm, raised.reason[:6]) == (pytest.approx(10.8), "raised")
    held = amplitude.choose(180.0, 10.0, cap, 1.2)
    assert (held.amplitude_nm, held.reason) == (pytest.approx(150.0), "held down by a limit")


def test_values_of_a_model_that_is_another_are_not_determined() -> None:
    """A lag that the model has not makes a motor of 1.6 kg m² one of 2.5 or more, with an interval that excludes it."""
    bus, mode = DEFAULT_BUS.values(), two_mass_resonance(**DEFAULT_BUS.values())
    assert mode is not None
    found = {}
    for lag_s in (0.0, 0.02):
        seen, unseen = (lagging(lag_s, seed) for seed in (1, 2))
        fit = fit_two_mass([seen], bus["J_M"] + bus["J_L"], mode)
        compared = [compare_record(ModelPlant("fitted", fit.model), unseen)]
        findings, judged = validated(fit, compared, mode, NOISE_RAD_S)
        found[lag_s] = next(each for each in findings if each.what == "J_M")
        low, high = judged.model.parameters["J_M"].bounds(may_be_zero=False)
        assert low < bus["J_M"] < high
        assert (fit.model.parameters["J_M"].low < bus["J_M"] < fit.model.parameters["J_M"].high) is not bool(lag_s)
    assert found[0.0].within is True
    assert found[0.02].within is False
    assert found[0.02].measured.endswith("kg m^2, not determined: the model leaves more than noise")
