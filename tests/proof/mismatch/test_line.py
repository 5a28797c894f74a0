"""One period of a bus with nothing hidden as a linear map: against the integrator it is read off."""

import numpy as np
import pytest

from hil.proof.mismatch.line import PARAMETERS, line_of, scaled
from hil.proof.power.drive import drive
from hil.proof.truth.specimen import draw_specimen
from hil.proof.truth.state import State

SHORT = 300


@pytest.mark.parametrize("test", [0, 1, 2])
def test_it_drives_as_the_integrator_does(test):
    driven = drive(draw_specimen("none", 4), test, SHORT)
    state = driven.state
    start = np.array([state[State.ANGLE_M] - state[State.ANGLE_L], state[State.SPEED_M], state[State.SPEED_L]])
    bus = draw_specimen("none", 4).bus
    speed = line_of(bus).speed_rad_s(driven.m1_nm + driven.m2_nm, bus.load_torque_nm, start)
    np.testing.assert_allclose(speed, driven.speed_rad_s(), atol=1e-9)


def test_load_and_start_move_it_in_proportion():
    bus = draw_specimen("none", 4).bus
    line, torque_nm = line_of(bus), np.linspace(0.0, 50.0, SHORT)
    by_load, by_twist, by_motor, by_load_speed = line.of_load_and_start(SHORT)
    whole = line.speed_rad_s(torque_nm, 30.0, np.array([0.01, 40.0, 41.0]))
    pieces = line.speed_rad_s(torque_nm, 0.0, np.zeros(3)) + 30.0 * by_load
    pieces += 0.01 * by_twist + 40.0 * by_motor + 41.0 * by_load_speed
    np.testing.assert_allclose(whole, pieces, atol=1e-9)


def test_a_scaled_bus_has_other_values_and_nothing_else():
    bus = draw_specimen("none", 4).bus
    other = scaled(bus, {"k": 1.1})
    assert other.k == pytest.approx(1.1 * bus.k)
    assert scaled(other, {"k": 1.0 / 1.1}).k == pytest.approx(bus.k)
    assert {name: getattr(other, name) for name in PARAMETERS if name != "k"} == {
        name: getattr(bus, name) for name in PARAMETERS if name != "k"
    }
