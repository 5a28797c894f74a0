"""Without excitation: a state of its own, an estimate that is held and less and less sure, and no alarm."""

import numpy as np
import pytest
from scipy.signal import lfilter

from estimator.identification.chain import OnlineChain, OnlineTrajectory
from estimator.identification.online.adaptation import ConstantForgetting
from estimator.identification.online.recursive import Status
from estimator.identification.settings import Settings
from estimator.identification.tracking.alarm import TrackingState
from estimator.identification.tracking.poles import N_THROUGH, output_density, pass_torque, sensitivity, weight_of
from estimator.signals.record import FloatArray, Record
from tests.estimator.identification.tracking import dirty_buses, roads
from tests.estimator.identification.tracking.drives import PRBS_NM, SAMPLE_TIME_S, Line, drives

TRACKING = Settings(adaptation=ConstantForgetting(0.995))
OFF_S, ON_S, END_S = 50.0, 90.0, 120.0


def off_in_between(time_s: float) -> float:
    return 0.0 if OFF_S <= time_s < ON_S else PRBS_NM


def play(record: Record) -> OnlineTrajectory:
    return OnlineChain(TRACKING, SAMPLE_TIME_S).run(record)


def between(course: OnlineTrajectory, begin_s: float, end_s: float) -> slice:
    return slice(*np.searchsorted(course.time_s, (begin_s, end_s)))


def on_a_road(seed: int) -> tuple[Record, float]:
    drive = roads.drive(seed, END_S, off_in_between)
    return drive.record, float(drive.frequency_hz[0])


def held_stiffly(seed: int) -> tuple[Record, float]:
    return drives(seed, 1, END_S, prbs_nm=off_in_between)[0], Line().resonance[0]


@pytest.mark.parametrize("world", [on_a_road, held_stiffly])
@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in (2, 3, 4))])
def test_prbs_off_is_a_state_of_its_own(world: object, seed: int) -> None:
    record, frequency_hz = world(seed)  # type: ignore[operator]
    course = play(record)
    assert course.alarms == ()
    off, on = between(course, OFF_S + 3.0, ON_S - 1.0), between(course, ON_S + 2.0, END_S)
    assert (course.state[off] == TrackingState.NOT_EXCITED).all()
    assert (course.state[on] == TrackingState.WATCHING).all()
    last = course[off.stop - 1]
    assert last.status is Status.NOT_EXCITED
    assert "PRBS" in last.reason
    assert last.resonance is not None
    assert abs(last.resonance.frequency_hz - frequency_hz) < 0.05
    std_hz = course.frequency_std_hz[off]
    assert (np.diff(std_hz[200:]) >= -1e-9 * std_hz[-1]).all()
    assert std_hz[-1] > 4.0 * std_hz[0]
    assert np.nanmedian(course.frequency_std_hz[on]) < 0.3 * std_hz[-1]


@pytest.mark.campaign
def test_so_it_is_with_a_bus_that_is_no_two_masses() -> None:
    for seed in (1, 4):
        course = play(dirty_buses.drive(seed, END_S, off_in_between))
        assert course.alarms == ()
        assert (course.state[between(course, OFF_S + 4.0, ON_S - 1.0)] == TrackingState.NOT_EXCITED).all()


def test_a_change_while_the_prbs_is_off_is_alarmed_when_it_is_on_again() -> None:
    after = Line(70.0, k=4200.0 * 0.85)
    for record in drives(31, 4, 140.0, (Line(), after), prbs_nm=off_in_between):
        first, settled = play(record).alarms
        assert ON_S < first.time_s < ON_S + 10.0
        assert first.changed_between_s[0] < 70.0 < first.changed_between_s[1]
        assert settled.after.value == pytest.approx(after.resonance[0], rel=0.01)


FREQUENCY_HZ, DAMPING, RHO = 8.2, 0.06, 0.003 + 0.001j
PERIOD_S = 0.02


def pole_at(frequency_hz: float) -> complex:
    turning = complex(-DAMPING, np.sqrt(1.0 - DAMPING**2))
    return complex(np.exp(2.0 * np.pi * frequency_hz * PERIOD_S * turning))


def mode_output(frequency_hz: float, u: FloatArray) -> FloatArray:
    return 2.0 * np.real(lfilter([RHO], [1.0, -pole_at(frequency_hz)], u.astype(complex)))


def through_the_mode(u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sensitivity, and the sample of the output's density, of every sample."""
    pole, through = pole_at(FREQUENCY_HZ), np.zeros(N_THROUGH)
    weight = weight_of(pole, RHO, DAMPING, PERIOD_S)
    psi, density = np.empty(u.size), np.empty(u.size)
    for t in range(u.size):
        psi[t] = sensitivity(weight, through)
        density[t] = output_density(psi[t], pole, FREQUENCY_HZ * DAMPING)
        pass_torque(u[t], pole, through)
    return psi, density


def test_sensitivity_is_the_derivative_of_the_modes_output() -> None:
    u = np.random.default_rng(1).normal(size=400)
    step = 1e-5
    slope = (mode_output(FREQUENCY_HZ + step, u) - mode_output(FREQUENCY_HZ - step, u)) / (2.0 * step)
    psi, _ = through_the_mode(u)
    assert psi == pytest.approx(np.diff(slope, prepend=0.0), abs=1e-6 * np.abs(slope).max())
