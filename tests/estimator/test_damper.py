"""Active damping: what is designed holds at lines of the region, by another way of closing the loop."""

from functools import cache

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from estimator.damper import PARAMETERS, Damper, Demand, Loop, Region, Timing, design_damper, sampled_line
from estimator.errors import BadSetting
from estimator.signals.prbs import prbs_nm

LINE = {"J_M": 1.6, "J_L": 100.0, "k": 4200.0, "c": 9.0, "b_M": 0.35, "b_L": 0.9}
T = 0.01
PRBS = prbs_nm(2046, 120.0, clock_divider=2)
NONE = np.empty(0)


def region(tolerance: float) -> Region:
    low, high = ({name: value * (1.0 + sign * tolerance) for name, value in LINE.items()} for sign in (-1.0, 1.0))
    return Region(LINE, low, high)


@cache
def designed() -> Damper:
    return design_damper(region(0.05), Timing(T, T), Demand(0.3, 120.0, PRBS))


def transfer(line: dict[str, float], period_s: float = T) -> tuple[np.ndarray, np.ndarray]:
    """Torque to speed under a held torque, from the line's transfer function."""
    J_M, J_L, k, c, b_M, b_L = (line[name] for name in PARAMETERS)
    den = np.polysub(np.polymul([J_M, c + b_M, k], [J_L, c + b_L, k]), np.polymul([c, k], [c, k]))
    num, den, _ = cont2discrete(([J_L, c + b_L, k], den[:-1]), period_s, "zoh")
    return num[0], den


def test_every_line_tried_has_the_damping_asked_for_by_its_characteristic_polynomial() -> None:
    found = designed()
    for line in (LINE, *region(0.05).random(60)):
        num, den = transfer(dict(line))
        loop = np.polymul(num, found.filter.b)
        poles = np.roots(np.polyadd(np.polymul(np.polymul(den, found.filter.a), [1.0, 0.0]), loop))
        assert np.abs(poles).max() < 1.0
        s = np.log(poles[poles.imag > 0]) / T
        near = (np.abs(s) > 2 * np.pi * 3.0) & (np.abs(s) < 2 * np.pi * 24.0)
        assert (-s.real / np.abs(s))[near].min() >= 0.3
        z = np.exp(1j * np.linspace(0.05, np.pi, 2000))
        gain = np.polyval(loop, z) / np.polyval(np.polymul(np.polymul(den, found.filter.a), [1.0, 0.0]), z)
        assert (1.0 / np.abs(1.0 + gain)).max() <= 2.0


def test_under_the_prbs_it_takes_the_torque_it_says_and_none_at_a_constant_speed() -> None:
    found = designed()
    (num, den), K = transfer(LINE), found.filter
    through = np.polymul(np.polymul(num, K.b), [1.0])
    loop = np.polyadd(np.polymul(np.polymul(den, K.a), [1.0, 0.0]), through)
    torque = lfilter(np.concatenate([np.zeros(loop.size - through.size), through]), loop, np.tile(PRBS, 4))
    assert np.abs(torque[-PRBS.size :]).max() == pytest.approx(found.torque_nm, rel=0.01)
    assert found.torque_nm <= 120.0
    assert abs(K.b.sum()) < 1e-9


def test_python_control_sees_the_same_poles_and_margins() -> None:
    control = pytest.importorskip("control", reason="python-control, of the group bench, is not installed")
    found = designed()
    plant = control.TransferFunction(*transfer(LINE), T) * control.TransferFunction([1.0], [1.0, 0.0], T)
    K = control.TransferFunction(found.filter.b, found.filter.a, T)
    loop = Loop([LINE], found.timing)
    (hz,), (damping,) = loop.modes(found.filter)
    s = np.log(control.feedback(plant, K).poles().astype(complex)) / T
    near = np.abs(np.abs(s) / (2 * np.pi) - hz)
    assert (-s.real / np.abs(s))[near.argmin()] == pytest.approx(damping, rel=1e-6)
    distance = control.stability_margins(plant * K)[2]
    assert 1.0 / distance == pytest.approx(loop.sensitivity(found.filter)[0], rel=0.01)


@pytest.mark.parametrize("late", [0, 4, 10, 13, 27])
def test_a_torque_acts_the_dead_time_after_it_was_asked_for(late: int) -> None:
    u = np.random.default_rng(1).standard_normal(80)
    fine = np.concatenate([np.zeros(late), np.repeat(u, 10)])[: 10 * u.size]
    A, B, C = sampled_line(LINE, Timing(T, 1e-3 * late))
    x, speed = np.zeros(A.shape[0]), []
    for each in u:
        speed.append(float(C @ x))
        x = A @ x + B * each
    assert np.allclose(speed, lfilter(*transfer(LINE, 1e-3), fine)[::10], atol=1e-9)


@pytest.mark.parametrize(
    ("tolerance", "timing", "limit_nm", "excitation", "reason"),
    [
        (0.0, Timing(T, 0.045), 500.0, NONE, "the dead time: 45.0 ms"),
        (0.0, Timing(T, T), 40.0, PRBS, "the torque: 40 Nm is not enough"),
        (0.2, Timing(T, 2 * T), 500.0, NONE, "the uncertainty: the nominal line alone could be damped"),
    ],
)
def test_what_can_not_be_damped_is_refused_with_what_is_in_the_way(
    tolerance: float, timing: Timing, limit_nm: float, excitation: np.ndarray, reason: str
) -> None:
    with pytest.raises(BadSetting, match=f"In the way is {reason}"):
        design_damper(region(tolerance), timing, Demand(0.3, limit_nm, excitation))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"k": 1e12}, "has a resonance of 1.268e.05 Hz, expected less than 50 Hz, half the sampling rate"),
        ({"k": 1.7e5}, "has a resonance of 52.* Hz, expected less than 50 Hz"),
        ({"J_M": 1e300}, "values too far apart for it: J_M = 1e\\+300"),
        ({"b_M": 1e100}, "values too far apart|no resonance that oscillates"),
        ({"k": 1e300, "J_M": 1e-300}, "values too far apart"),
        ({"J_M": 1e-300, "J_L": 1e-300}, "values too far apart|has a resonance of|no resonance that oscillates"),
    ],
)
def test_a_line_that_no_sampled_damper_can_be_designed_for_is_refused(changed: dict[str, float], said: str) -> None:
    line = LINE | changed
    with pytest.raises(BadSetting, match=said):
        design_damper(Region(line, line, line), Timing(T, T), Demand(0.3, 120.0, NONE))
