"""What comes of an inverter's reading: limits, losses and ripple, measured at the shaft."""

import math

import numpy as np
import pytest

from hil.proof.truth import laws
from hil.proof.truth.driveline import TruthDriveline, true_torque
from hil.proof.truth.laws import TIME_TO_DERATE_S
from hil.proof.truth.physics import SPEEDS, StateIndex


def test_a_torque_derates_exponentially_or_evenly(plain):
    exponential = plain._replace(derating=0.2, derating_time_s=6.0)
    assert true_torque(exponential, (60.0, 40.0), 0.0) == pytest.approx(100.0)
    assert true_torque(exponential, (60.0, 40.0), 6.0) == pytest.approx(100.0 * (1.0 - 0.2 * (1.0 - math.exp(-1.0))))
    even = plain._replace(derating=0.2)
    assert true_torque(even, (60.0, 40.0), TIME_TO_DERATE_S / 2) == pytest.approx(90.0)
    assert true_torque(even, (60.0, 40.0), 2 * TIME_TO_DERATE_S) == pytest.approx(80.0)


def test_what_goes_with_time_begins_when_the_clock_does(plain):
    """A torque that derates evenly: whole while the clock stands still, then as from the beginning."""
    derating = plain._replace(derating=0.2)
    later, whole = TruthDriveline(derating, still_s=2.0), TruthDriveline(plain)
    for _ in range(200):
        later.advance((60.0, 40.0), 0.01)
        whole.advance((60.0, 40.0), 0.01)
    np.testing.assert_array_equal(later.state[list(SPEEDS)], whole.state[list(SPEEDS)])
    for _ in range(300):
        later.advance((60.0, 40.0), 0.01)
    assert later.quantity(StateIndex.TIME_S) == pytest.approx(3.0, abs=0.011)


@pytest.mark.parametrize(
    ("limits", "readings", "given"),
    [
        ({"limit_m1_nm": 100.0}, (300.0, 50.0), 150.0),
        ({"limit_m2_nm": 100.0}, (300.0, 50.0), 350.0),
        ({"limit_m2_nm": 100.0}, (-50.0, -300.0), -150.0),
        ({"limit_total_nm": 200.0}, (300.0, 300.0), 200.0),
        ({"limit_total_nm": 200.0}, (300.0, -250.0), 50.0),
    ],
)
def test_a_limit_holds_for_what_it_is_of(plain, limits, readings, given):
    p = plain._replace(limit_knee=20.0, **limits)
    assert true_torque(p, readings, 0.0) == pytest.approx(given, rel=2e-3)


def test_a_machine_saturates_of_each_sign_by_itself(plain):
    p = plain._replace(saturating_nm=400.0, saturating_back_nm=1200.0)
    assert true_torque(p, (200.0, 200.0), 0.0) == pytest.approx(400.0 * math.log(1.0 + math.sqrt(2.0)))
    assert true_torque(p, (-200.0, -200.0), 0.0) == pytest.approx(-1200.0 * math.asinh(1.0 / 3.0))
    assert true_torque(p, (1.0, 0.0), 0.0) == pytest.approx(1.0, rel=1e-5)


def test_an_offset_comes_and_has_come_by_half_at_its_time(plain):
    p = plain._replace(bias_nm=20.0, bias_half_s=5.0)
    given = [true_torque(p, (60.0, 40.0), time_s) - 100.0 for time_s in (0.0, 5.0, 1e6)]
    assert given == pytest.approx([0.0, 10.0, 20.0], abs=1e-3)


def _harmonics(p, torque_nm):
    """Amplitudes of the torque over a turn, shape (65,): index is periods per turn."""
    angles = np.arange(128) * 2 * np.pi / 128
    return 2 * np.abs(np.fft.rfft([laws.ripple_torque(p, angle, torque_nm) for angle in angles])) / 128


def test_cogging_needs_no_torque_and_current_ripple_grows_with_it(plain):
    cogging = plain._replace(ripple_nm=12.0, ripple_order=6.0)
    for torque_nm in (0.0, 300.0):
        assert _harmonics(cogging, torque_nm)[6] == pytest.approx(12.0)
        assert _harmonics(cogging, torque_nm)[12] == pytest.approx(12.0 * laws.RIPPLE_OVERTONE)
    current = plain._replace(ripple_share=0.1, ripple_order=4.0)
    assert _harmonics(current, 200.0)[4] == pytest.approx(20.0)
    assert not _harmonics(current, 0.0).any()
