"""The headline of an identification: a pole pair that the data need, intervals, and one verdict."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.identification.best import BestEstimate, ModelVerdict, best_estimate
from estimator.identification.linear_model import Orders
from estimator.identification.modes.modes import Uncertain
from estimator.identification.modes.physical import NAMES, two_mass_model
from estimator.identification.offline.fits import LinearFit, fit_box_jenkins, fit_output_error, problem_of
from estimator.signals.decimate import high_passed
from estimator.signals.prbs import prbs_nm
from estimator.signals.record import BoolArray, Record
from tests.benchmarks.buses import CLEAN, draw_bus, drive
from tests.estimator.identification.driveline import (
    B_L,
    B_M,
    J_L,
    J_M,
    C,
    K,
    cruise,
    true_resonance,
    uncertain_resonance,
)

FREQUENCY_HZ, DAMPING = true_resonance()
PERIOD_S, SUBSTEPS = 0.01, 50


def with_gap(seed: int, gap_rad: float = 0.02, duration_s: float = 30.0) -> Record:
    """Return a cruise on a line with a gap: a dead zone of the twist, integrated by the semi-implicit Euler method."""
    rng = np.random.default_rng(seed)
    n, step_s = round(duration_s / PERIOD_S), PERIOD_S / SUBSTEPS
    load_nm = 20.0
    torque = load_nm + 60.0 * (B_M + B_L) + np.repeat(prbs_nm(n // 2, 120.0, seed=seed), 2)
    motor, load, twist = 60.0, 60.0, 0.5 * gap_rad + load_nm / K
    speed = np.zeros(n)
    for i in range(n):
        speed[i] = motor
        for _ in range(SUBSTEPS):
            inside = abs(twist) <= 0.5 * gap_rad
            beyond = 0.0 if inside else twist - np.sign(twist) * 0.5 * gap_rad
            shaft = 0.0 if inside else K * beyond + C * (motor - load)
            motor += step_s * (torque[i] - shaft - B_M * motor) / J_M
            load += step_s * (shaft - load_nm - B_L * load) / J_L
            twist += step_s * (motor - load)
    measured = np.round((torque + rng.normal(0.0, 0.3, n)) / 0.6) * 0.6
    okay = np.ones(n, dtype=bool)
    return Record(
        "gap", PERIOD_S, PERIOD_S * np.arange(n), measured[:, np.newaxis], speed + rng.normal(0.0, 0.05, n), okay
    )


def pair(best: BestEstimate) -> tuple[float, float]:
    assert best.mode is not None
    return best.mode.frequency_hz.value, best.mode.damping.value


@pytest.mark.campaign
@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in (2, 3))])
def test_with_a_gap_the_damping_is_near_the_linear_one_and_what_it_depends_on_is_shown(seed: int) -> None:
    best = best_estimate(with_gap(seed))
    assert best.verdict is ModelVerdict.NOT_LINEAR
    assert best.band_hz == (2.0, 40.0)
    assert best.linearity.depends_on == "the torque in the shaft"
    assert pair(best)[1] == pytest.approx(DAMPING, rel=0.15)
    in_the_middle, outside = best.regions[1].mode, (best.regions[0].mode, best.regions[2].mode)
    assert len(best.regions) == 3
    assert in_the_middle is None or all(
        mode is not None and mode.frequency_hz > in_the_middle.frequency_hz for mode in outside
    )


@pytest.mark.campaign
@pytest.mark.parametrize("seed", [20, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in (32, 111))])
def test_buses_on_which_other_minima_are_near(seed: int) -> None:
    """Of 200 those on which an output-error fit, a subspace estimate and this one are furthest off."""
    bus = draw_bus(seed)
    found = pair(best_estimate(drive(bus)))
    for value, truth, within in zip(found, bus.line.resonance(), (0.005, 0.03), strict=True):
        assert value == pytest.approx(truth, rel=within)


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("buses", "independent", "good"), [(2, 1, 1), pytest.param(10, 8, 6, marks=pytest.mark.campaign)]
)
def test_healthy_recordings_pass_their_own_residual_tests(buses: int, independent: int, good: int) -> None:
    """A test at 95 % fails on one in twenty: on both of 2 with a probability of 0.25 %, on 3 of 10 with 1.2 %."""
    found = [best_estimate(drive(draw_bus(seed), world=CLEAN)) for seed in range(5000, 5000 + buses)]
    assert sum(best.validation.independence.is_independent for best in found) >= independent
    assert sum(best.verdict is ModelVerdict.GOOD for best in found) >= good  # tests of linearity and feedback fail, too
    assert all(best.linearity.is_linear for best in found)


def lost(record: Record, okay: BoolArray) -> Record:
    """Return a recording in which rows were lost whole: no output, and the torque held from the row before."""
    rows = np.maximum.accumulate(np.where(okay, np.arange(okay.size), 0))
    output = np.where(okay, record.output, np.nan)
    return replace(record, output=output, okay=okay, torque_nm=record.torque_nm[rows], torque_okay=okay)


@pytest.mark.campaign
def test_lost_rows_cost_no_more_than_what_they_held() -> None:
    source = cruise(7, duration_s=30.0).record
    okay = np.ones(source.okay.shape, dtype=bool)
    okay[[500, 1200, 2000]] = okay[1500:1600] = False  # three rows, and all of one second
    whole, broken = (fit_box_jenkins(high_passed(record), Orders(3, 3, 1)) for record in (source, lost(source, okay)))
    blind = fit_box_jenkins(replace(high_passed(lost(source, okay)), torque_okay=None), Orders(3, 3, 1))
    assert broken.noise.std == pytest.approx(whole.noise.std, rel=0.03)
    assert blind.noise.std > 1.2 * whole.noise.std  # torque that was held instead is no torque that acted
    for one, other in zip(mode_of(broken), mode_of(whole), strict=True):
        assert one.value == pytest.approx(other.value, abs=2.0 * other.std)
        assert one.std == pytest.approx(other.std, rel=0.25)


def mode_of(fit: LinearFit) -> tuple[Uncertain, Uncertain]:
    mode = uncertain_resonance(fit.model, fit.covariance)
    assert mode is not None
    return mode.frequency_hz, mode.damping


def test_a_fast_recording_keeps_its_period_and_its_answer() -> None:
    source = cruise(8, duration_s=20.0).record
    fast = replace(
        source,
        sample_time_s=PERIOD_S / 2.0,
        time_s=np.arange(2 * source.time_s.size) * PERIOD_S / 2.0,
        torque_nm=np.repeat(source.torque_nm, 2, axis=0),
        output=np.repeat(source.output, 2),
        okay=np.repeat(source.okay, 2),
    )
    best = best_estimate(fast)
    assert best.fit.model.sample_time_s == PERIOD_S / 2.0
    assert best.fit.block == 2
    assert pair(best)[0] == pytest.approx(FREQUENCY_HZ, rel=0.005)


def test_a_fit_from_the_truth_is_no_better() -> None:
    bus = draw_bus(56)
    data = high_passed(drive(bus))
    problem, _ = problem_of(data, Orders(3, 3, 1))
    truth = two_mass_model(np.array([bus.line.parameters[name] for name in NAMES]), PERIOD_S)
    from_truth = problem.residual(problem.solve([truth]))
    fit = fit_output_error(data, Orders(3, 3, 1))
    assert fit.model.is_stable
    assert fit.rms <= 1.001 * np.sqrt(np.mean(from_truth**2))
