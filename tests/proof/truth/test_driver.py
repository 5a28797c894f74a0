"""The bus really rolls steadily when a recording begins."""

import pytest

from hil.proof.truth.driveline import bring_to_speed
from hil.proof.truth.physics import State

EFFECTS = {
    "nothing": {},
    "friction": {"friction_motor_nm": 20.0},
    "drag": {"quadratic_motor": 0.02, "quadratic_load": 0.01},
    "gain": {"gain_m1": 0.9},
    "late": {"delay_s": 0.03, "current_loop_time_s": 0.02},
    "gap": {"gap_rad": 0.03},
}


@pytest.mark.parametrize("speed", [0.0, 70.0])
@pytest.mark.parametrize("changes", EFFECTS.values(), ids=EFFECTS)
def test_a_held_pedal_holds_the_speed(plain, changes, speed):
    rolling = bring_to_speed(plain._replace(load_torque_nm=50.0, **changes), speed, share_m1=0.4)
    start = rolling.driveline.quantity(State.SPEED_L)
    rolling.driveline.advance((0.4 * rolling.torque_nm, 0.6 * rolling.torque_nm), 10.0)
    assert start == pytest.approx(speed, abs=0.4)
    assert rolling.driveline.quantity(State.SPEED_L) == pytest.approx(start, abs=0.05)


def test_hills_and_brake_begin_with_the_recording(plain):
    p = plain._replace(brake_nm=50.0, brake_from_s=0.0, brake_to_s=10.0)
    driveline = bring_to_speed(p, 60.0, 0.5).driveline
    assert driveline.quantity(State.SPEED_L) == pytest.approx(60.0, abs=0.4)
    assert driveline.quantity(State.TIME_S) == 0.0
    assert driveline.quantity(State.ANGLE_L) == 0.0
    assert driveline.physics == p
