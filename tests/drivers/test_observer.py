"""What drives and vehicle must do: a road is a load, and a speed that is wrong is not."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from drivers.inverter.observer import LowPass, Motion, TorquePrediction, VehicleObserver
from drivers.inverter.supervision import _wrong_motion
from drivers.inverter.vehicle import GRAVITY_M_S2, Vehicle

PERIOD_S = 0.01
VEHICLE = Vehicle(100.0, 50.0, 150.0, most_grade=0.12, travel_m_per_rad=0.086)


@dataclass
class Bus:
    """Motor and body on a shaft, with dry friction, on a road; a hold of its speed drives it, with a PRBS."""

    mass: float = 1.0
    grade: Callable[[float], float] = lambda way_m: 0.0
    speed_rad_s: float = 20.0
    step_nm: float = 0.0
    read: Callable[[float, float], float] = lambda speed, time_s: speed
    prbs_nm: float = 60.0
    seed: int = 0
    motions: list[Motion] = field(default_factory=list)

    def drive(self, seconds: float) -> float:
        """Drive it until the observer is surprised; the speed of the body then, or at the end."""
        observer, low_pass, rng = (
            VehicleObserver(VEHICLE, PERIOD_S),
            LowPass(PERIOD_S),
            np.random.default_rng(self.seed),
        )
        motor = body = twist = way = wanted = held = 0.0
        inertia = self.mass * VEHICLE.inertia_kg_m2
        for k in range(round(seconds / PERIOD_S)):
            speed = self.read(motor + 0.05 * rng.standard_normal(), k * PERIOD_S)
            error = self.speed_rad_s - speed
            held += 20.0 * error * PERIOD_S * (abs(wanted) < 500.0)
            wanted += max(-10.0, min(10.0, max(-500.0, min(500.0, 100.0 * error + held)) - wanted))
            step_nm = self.step_nm * (1.0 if k // 200 % 2 else -1.0) if abs(error) < 10.0 else 0.0
            torque = wanted + step_nm + self.prbs_nm * (1.0 if rng.random() < 0.5 else -1.0)
            motion = observer.take(torque, low_pass.take(speed), speed, 1)
            if motion is not None:
                self.motions.append(motion)
                if wrong(motion):
                    break
            load = inertia * GRAVITY_M_S2 / VEHICLE.travel_m_per_rad * self.grade(way)
            for _ in range(10):
                shaft = 4200.0 * twist + 9.0 * (motor - body)
                motor += 0.001 * (torque - shaft) / 1.6
                body += 0.001 * (shaft - load) / (inertia - 1.6)
                rubbed = 0.001 * 0.7 * inertia / (inertia - 1.6)
                body = 0.0 if abs(body) <= rubbed else body - math.copysign(rubbed, body)
                twist += 0.001 * (motor - body)
                way += 0.001 * body * VEHICLE.travel_m_per_rad
        return body


LOW, HIGH = VEHICLE.gains
MOST = VEHICLE.most_load_rad_s2
FINE = Motion(
    speed_rad_s=10.0, predicted_rad_s=10.0, deviation_rad_s=0.1, gain=1.0, gain_deviation=0.01, load_rad_s2=0.0,
    load_deviation_rad_s2=0.1, held_rad_s=0.0, surprise=0.0,
)  # fmt: skip


@pytest.mark.parametrize(
    ("bound", "within", "said"),
    [
        ("held_rad_s", (-1.0, 1.0), "and stands, expected it to have changed by"),
        ("surprise", (0.0, 15.0), "the speed 0x606C is 10 rad/s, expected 10 within 0.3 rad/s"),
        ("gain", (LOW / 1.15 - 0.03, HIGH * 1.15 + 0.03), "times as fast as the torque makes 100 kg m2 change"),
        ("load_rad_s2", (-MOST - 0.3, MOST + 0.3), "(a grade of 12 %); the speed 0x606C is 10 rad/s"),
    ],
)
def test_each_bound_of_a_motion_is_kept_to_its_end(bound: str, within: tuple[float, float], said: str) -> None:
    low, high = within
    for value in (low + 1e-6, high - 1e-6):
        assert _wrong_motion(FINE._replace(**{bound: value}), VEHICLE) == ""
    for value in (low - 1e-6, high + 1e-6) if bound != "surprise" else (high + 1e-6,):
        assert said in _wrong_motion(FINE._replace(**{bound: value}), VEHICLE)


def wrong(motion: Motion) -> bool:
    return bool(_wrong_motion(motion, VEHICLE))


@pytest.mark.parametrize("mass", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("step_nm", [0.0, 300.0])
@pytest.mark.parametrize(
    "grade",
    [
        lambda way: 0.0,
        lambda way: 0.01,
        lambda way: -0.03 if way > 5.0 else 0.0,
        lambda way: 0.02 * math.sin(way / 4.0),
    ],
    ids=["level", "1 %", "down by 3 % at once", "hills"],
)
def test_a_road_is_a_load(mass: float, step_nm: float, grade: Callable[[float], float]) -> None:
    bus = Bus(mass, grade, step_nm=step_nm)
    bus.drive(20.0)
    assert not any(map(wrong, bus.motions))


@pytest.mark.parametrize("mass", [0.5, 1.0, 1.5])
def test_the_inertia_is_found_within_its_deviation(mass: float) -> None:
    bus = Bus(mass, lambda way: 0.01, step_nm=300.0)
    bus.drive(25.0)
    last = bus.motions[-1]
    assert last.gain == pytest.approx(1.0 / mass, abs=3.0 * last.gain_deviation)
    assert last.gain_deviation < 0.15


def stuck() -> Callable[[float, float], float]:
    kept: list[float] = []

    def read(speed: float, time_s: float) -> float:
        kept.append(speed)
        return kept[0]

    return read


@pytest.mark.parametrize("mass", [0.7, 1.0, 1.4])
@pytest.mark.parametrize("read", [lambda w, t: -w, lambda w, t: 0.0], ids=["reversed", "zero"])
def test_a_wrong_speed_from_standstill_on_is_no_load(mass: float, read: Callable[[float, float], float]) -> None:
    assert abs(Bus(mass, read=read).drive(60.0)) < 9.0


@pytest.mark.parametrize("factor", [-1.0, 0.0, 0.5])
def test_a_speed_that_is_wrong_from_a_moment_on_is_no_load(factor: float) -> None:
    bus = Bus(read=lambda w, t: w if t < 8.0 else factor * w)
    assert abs(bus.drive(30.0)) < 30.0
    assert wrong(bus.motions[-1])


def test_a_speed_that_stands_to_the_last_bit_is_no_load() -> None:
    assert abs(Bus(read=stuck()).drive(60.0)) < 9.0


def range_of(commands: list[tuple[float, float]], late: int = 0, slope: float | None = None) -> tuple[float, float]:
    prediction = TorquePrediction(PERIOD_S, PERIOD_S, slope, 20)
    for target, offset in commands:
        prediction.command(target, offset)
    return prediction.range(late)


def test_a_torque_is_predicted_from_the_last_three_commands_and_no_more_for_answers_that_are_lost() -> None:
    commands = [(500.0, 0.0), (0.0, 60.0), (0.0, 60.0), (0.0, 60.0)]
    assert range_of(commands) == (60.0, 60.0)
    assert range_of(commands, late=1) == (60.0, 500.0)


def test_a_slope_holds_the_target_and_not_the_offset() -> None:
    low, high = range_of([(500.0, 60.0)] * 10 + [(500.0, -60.0)] * 3, slope=700.0)
    assert (low, high) == pytest.approx((700.0 * 0.11 - 60.0, 700.0 * 0.13 - 60.0))


def test_a_slow_response_is_as_uncertain_as_it_is_long() -> None:
    prediction = TorquePrediction(PERIOD_S, 0.1, None, 20)
    for _ in range(3):
        prediction.command(100.0, 0.0)
    low, high = prediction.range()
    assert (low, high) == pytest.approx((100.0 * (1.0 - math.exp(-0.3)), 100.0))


@pytest.mark.parametrize("factor", [-1.0, 0.0], ids=["reversed", "zero"])
def test_a_speed_gone_wrong_in_a_slow_cruise_whose_torque_turns_all_the_time(factor: float) -> None:
    """The PRBS is larger than the torque of the cruise: it turns many times in the 0.6 s in which a shaft unwinds."""
    bus = Bus(speed_rad_s=2.0, read=lambda w, t: w if t < 15.0 else factor * w)
    assert abs(bus.drive(60.0)) < 5.0
    assert wrong(bus.motions[-1])
    assert not any(map(wrong, bus.motions[:140]))


@pytest.mark.parametrize("grade", [-0.06, 0.03, 0.06])
@pytest.mark.parametrize("mass", [0.5, 1.5])
def test_a_start_on_a_grade_is_no_wrong_gain(grade: float, mass: float) -> None:
    bus = Bus(mass, lambda way_m: grade if mass < 1.0 else grade / 3.0)
    bus.drive(15.0)
    assert not any(map(wrong, bus.motions))


def test_a_drive_that_shows_a_slow_motor_as_standing_is_not_dead() -> None:
    bus = Bus(speed_rad_s=2.0, read=lambda w, t: 0.0 if abs(w) < 0.3 else w)
    bus.drive(20.0)
    assert not any(map(wrong, bus.motions))


def test_a_drive_that_shows_a_bus_as_standing_where_a_hill_stops_it_is_not_dead() -> None:
    """Torque less load is known better than each: both were estimated from the same acceleration."""
    slow = {"read": lambda w, t: 0.0 if abs(w) < 0.3 else w, "prbs_nm": 0.0}
    bus = Bus(1.4, speed_rad_s=30.0, grade=lambda way: min(0.01 * way, 0.033), **slow)
    assert abs(bus.drive(20.0)) < 30.0
    assert any(motion.held_rad_s for motion in bus.motions)
    assert not any(map(wrong, bus.motions))
