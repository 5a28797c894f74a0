"""Supervision: what is wrong ends a run within its limit, in any pattern; what a sound drive does never does."""

import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.errors import DeviceFault, DeviceTimeout, WrongTorque
from drivers.guard_limits import ErrorLimits, GuardLimits
from drivers.inverter.cia402 import FAULT_STATES, PowerState, TorqueMode
from drivers.inverter.drive_supervision import MOST_SURPLUS, DriveRecord
from drivers.inverter.feedback import InverterFeedback
from drivers.inverter.settings import InverterSettings
from drivers.inverter.supervision import (
    SPEED_NOISE_RAD_S,
    CycleRecord,
    Supervision,
    SupervisionLimits,
    rules_table,
)
from drivers.inverter.vehicle import Vehicle
from estimator.signals.prbs import Prbs
from tests.drivers.can_bench import M1, M2

PERIOD_S = 0.01
PERIOD_NS = 10_000_000
ERROR = ErrorLimits(m1_nm=30.0, m2_nm=30.0, sum_nm=math.hypot(30.0, 30.0), time_s=0.12, response_s=0.01)
GUARD = GuardLimits(400.0, 400.0, 120.0, 2000.0, 700.0, 0.2, 1.0, math.inf, PERIOD_S, ERROR)
AT_LIMIT = 12
"""Cycles of a torque just outside its tolerance: 0.12 s."""

Drive = Callable[[list[float]], float]
"""Gives its torque from its commands so far [Nm]."""

_noise = itertools.count()


def answer(torque_nm: float = 0.0, speed_rad_s: float = 0.0, **more: object) -> InverterFeedback:
    """A reading that differs from the one before in its last bit, as readings do."""
    raw = next(_noise)
    seen = InverterFeedback(torque_nm, speed_rad_s, PowerState.OPERATION_ENABLED, 0, raw, 0)
    return seen._replace(**more)  # type: ignore[arg-type]


def supervised(
    settings: InverterSettings = M1, error: ErrorLimits = ERROR, inertia_kg_m2: float | None = None
) -> Supervision:
    usual = inertia_kg_m2
    vehicle = (
        None if usual is None else Vehicle(usual, 0.5 * usual, 1.5 * usual, most_grade=0.12, travel_m_per_rad=0.086)
    )
    return Supervision(SupervisionLimits(replace(GUARD, error=error), 0.0, 0.0, vehicle), settings, M2)


def cycles_to_end(made: Supervision, course: Iterable[tuple[DriveRecord, DriveRecord]]) -> int | None:
    """Take cycle after cycle; how many until the run ends, None where it does not."""
    for cycle, (m1, m2) in enumerate(course):
        made.take(CycleRecord(cycle * PERIOD_NS, m1, m2))
        if made.ended is not None:
            return cycle + 1
    return None


def m1_alone(
    readings: Iterable[InverterFeedback | None], command_nm: float = 100.0, made: Supervision | None = None
) -> int | None:
    still = ((DriveRecord(command_nm, each), DriveRecord(0.0, answer())) for each in readings)
    return cycles_to_end(made or supervised(), still)


def torques(*torques_nm: float, **more: object) -> list[InverterFeedback]:
    return [answer(each, 0.0, **more) for each in torques_nm]


def steady(cycle: int) -> float:
    return 100.0


def prbs(divider: int) -> Callable[[int], float]:
    levels = Prbs(60.0, 10, divider, 1)
    course = [levels.next() for _ in range(3000)]
    return lambda cycle: course[cycle]


def ramp(cycle: int) -> float:
    """2000 Nm/s, up and down again."""
    return 20.0 * (20 - abs(cycle % 40 - 20))


QUICK = prbs(1)


def around_a_torque(cycle: int) -> float:
    return 100.0 + QUICK(cycle)


COURSES = {"steady": steady, "prbs": prbs(2), "slow prbs": prbs(5), "quick prbs": around_a_torque, "ramp": ramp}
WRONG: dict[str, Drive] = {
    "double": lambda commands: 2.0 * commands[-1],
    "nothing": lambda commands: 0.0,
    "offset": lambda commands: commands[-1] + 80.0,
    "reverse": lambda commands: -commands[-1],
}
RIGHT: dict[str, Drive] = {
    "at once": lambda commands: commands[-1],
    "one cycle later": lambda commands: (commands[-2:])[0],
    "two cycles later": lambda commands: (commands[-3:])[0],
    "sometimes later": lambda commands: (commands[-1 - len(commands) // 50 % 2 :])[0],
    "off by less than the limit": lambda commands: commands[-1] + 29.9,
    "3 % too much": lambda commands: 1.03 * commands[-1],
}


def driven(course: Callable[[int], float], drive: Drive, start: int = 0, limit: int = 2000) -> int | None:
    def cycles() -> Iterable[tuple[DriveRecord, DriveRecord]]:
        commands = [0.0]
        for cycle in range(start, start + limit):
            commands.append(course(cycle))
            yield DriveRecord(commands[-1], answer(drive(commands))), DriveRecord(0.0, answer())

    return cycles_to_end(supervised(), cycles())


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_torque_ends_the_run_in_time(course: str, wrong: str) -> None:
    for start in range(0, 1000, 37):
        noticed = driven(COURSES[course], WRONG[wrong], start, limit=100)
        assert noticed is not None
        assert noticed * PERIOD_S <= 0.3, f"from cycle {start}"


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("right", RIGHT)
def test_a_torque_that_follows_is_left_alone(course: str, right: str) -> None:
    assert driven(COURSES[course], RIGHT[right]) is None


def test_the_tolerance_itself_is_allowed_and_a_hair_more_is_not() -> None:
    for sign in (1.0, -1.0):
        assert m1_alone(torques(*[100.0 + sign * 30.0] * 50)) is None
        assert m1_alone(torques(*[100.0 + sign * 30.001] * 50)) == AT_LIMIT


@pytest.mark.parametrize(("off_nm", "cycles"), [(45.0, 8), (90.0, 4), (180.0, 2), (359.0, 2), (360.0, 1), (5000.0, 1)])
def test_it_is_the_impulse_that_counts(off_nm: float, cycles: int) -> None:
    """30 Nm for 0.12 s is 3.6 Nm s: a torque further off is ended sooner, one of 360 Nm at once."""
    error = replace(ERROR, sum_nm=1e6)
    assert m1_alone(torques(*[100.0 + off_nm] * 50), made=supervised(error=error)) == cycles


@pytest.mark.parametrize(("bad", "of"), [(11, 31), (1, 3), (1, 10), (2, 50), (1, 100)])
def test_bursts_of_any_pattern_end_once_they_add_up(bad: int, of: int) -> None:
    pattern = [200.0] * bad + [100.0] * (of - bad)
    ended = m1_alone(torques(*pattern * 20))
    assert ended is not None
    assert sum(each == 200.0 for each in (pattern * 20)[:ended]) <= 6


def test_one_reading_in_ten_seconds_adds_up_to_nothing() -> None:
    assert m1_alone(torques(*([300.0] + [100.0] * 999) * 5)) is None


def test_both_together_have_a_limit_below_the_sum_of_theirs() -> None:
    def both(m1_nm: float, m2_nm: float) -> str:
        made = supervised()
        pair = [(DriveRecord(100.0, answer(m1_nm)), DriveRecord(100.0, answer(m2_nm))) for _ in range(50)]
        cycles_to_end(made, pair)
        return str(made.ended)

    assert "both inverters: torque actual value 0x6077 is 244 Nm, expected 200 Nm" in both(122.0, 122.0)
    assert "is 156 Nm, expected 200 Nm" in both(78.0, 78.0), "too little is as wrong as too much"
    assert both(121.0, 121.0) == "None"
    assert both(129.0, 71.0) == "None", "opposite errors turn no shaft"


def test_a_drive_that_says_it_is_limited_may_give_less_and_no_more() -> None:
    assert m1_alone(torques(*[60.0] * 500, limited=True)) is None
    assert m1_alone(torques(*[131.0] * 50, limited=True)) == AT_LIMIT
    assert m1_alone(torques(*[-31.0] * 50, limited=True)) == AT_LIMIT


def test_a_limit_that_takes_all_of_the_torque_ends_the_run() -> None:
    """Some 100 Nm missing are 30 Nm s, which is 30 Nm for 1 s, after 0.3 s."""
    made = supervised()
    assert m1_alone(torques(*[1.2] * 500, limited=True), made=made) == 31
    assert "bit 11 (internal limit) is set and the torque 0x6077 is 1.2 Nm, expected some of the 100" in str(made.ended)
    assert m1_alone(torques(*[-27.0] * 500, limited=True), 250.0) == 14
    assert m1_alone(torques(*[31.0] * 500, limited=True)) is None
    assert m1_alone(torques(*[0.0] * 500, limited=True), command_nm=30.0) is None


@pytest.mark.parametrize(
    "state", [each for each in PowerState if each not in {PowerState.OPERATION_ENABLED, *FAULT_STATES}]
)
@pytest.mark.parametrize("mode", TorqueMode)
@pytest.mark.parametrize("follows", [True, False])
def test_another_state_ends_the_run_in_that_cycle(state: PowerState, mode: TorqueMode, follows: bool) -> None:
    made = supervised(replace(M1, mode=mode))
    assert m1_alone([*torques(100.0), answer(0.0, state=state, follows=follows)], made=made) == 2
    with pytest.raises(DeviceFault, match=rf"inverter m1 .*power state is {state.value} after controlword 0x000F"):
        made.raise_if_ended()


def ignoring(n: int) -> list[InverterFeedback]:
    return torques(*[0.0] * n, follows=False)


def test_bit_12_has_the_time_of_a_state_before_it_first_is_set_and_no_torque_is_asked_for() -> None:
    settings = replace(M1, state_timeout_s=0.5)
    made = supervised(settings)
    assert m1_alone(ignoring(50), 0.0, made) is None
    assert not made.ready
    assert m1_alone(ignoring(60), 0.0, supervised(settings)) == 51
    made = supervised(settings)
    assert m1_alone([*ignoring(40), *torques(0.0)], 0.0, made) is None
    assert made.ready
    assert m1_alone([*torques(0.0), *ignoring(60)], 0.0, supervised(settings)) == 1 + AT_LIMIT + 1
    assert m1_alone(ignoring(60), 29.0, supervised(settings)) == AT_LIMIT + 1, "a torque is asked for"


def test_bit_12_is_no_leave_to_give_nothing() -> None:
    made = supervised()
    assert m1_alone([*torques(100.0), *ignoring(20)], made=made) == 1 + 4
    assert "bit 12 is 0, expected 1: in mode 10 (cyclic synchronous torque) the drive ignores" in str(made.ended)


@pytest.mark.parametrize(
    "settings", [replace(M1, follow_bit=False), replace(M1, mode=TorqueMode.PROFILE_TORQUE)], ids=["without", "mode 4"]
)
def test_bit_12_means_nothing_where_a_drive_has_it_not(settings: InverterSettings) -> None:
    made = supervised(settings)
    assert m1_alone(torques(*[100.0] * 300, follows=False), made=made) is None
    made.take(CycleRecord(10**10, DriveRecord(0.0, answer(follows=False)), DriveRecord(0.0, answer())))
    assert made.ready


def repeated(commands_nm: Iterable[float]) -> int | None:
    old = answer(100.0)
    return cycles_to_end(supervised(), ((DriveRecord(each, old), DriveRecord(0.0, answer())) for each in commands_nm))


def test_a_reading_that_repeats_is_stale_after_an_impulse_of_the_command() -> None:
    """30 Nm for 0.2 s: 6 Nm s, six cycles of a step of 120 Nm, for some is forgotten; none while the command stands."""
    assert repeated([100.0] * 500) is None
    assert repeated([100.0] * 20 + [129.0, 100.0] * 200) is None
    assert repeated([100.0] * 20 + [220.0, 100.0] * 200) == 20 + 2 * 5 + 1


def test_a_slow_drive_that_repeats_some_readings_is_left_alone() -> None:
    def cycles() -> Iterable[tuple[DriveRecord, DriveRecord]]:
        seen = answer()
        for cycle in range(2000):
            command_nm = QUICK(cycle)
            seen = seen if cycle % 3 else answer(command_nm)
            yield DriveRecord(command_nm, seen), DriveRecord(0.0, answer())

    assert cycles_to_end(supervised(), cycles()) is None


def speeds(pairs: Iterable[tuple[float, float]], made: Supervision | None = None) -> int | None:
    pair = ((DriveRecord(0.0, answer(0.0, m1)), DriveRecord(0.0, answer(0.0, m2))) for m1, m2 in pairs)
    return cycles_to_end(made or supervised(), pair)


def test_two_readings_of_one_shaft_may_differ_by_noise_and_share() -> None:
    assert speeds([(0.0, SPEED_NOISE_RAD_S)] * 500) is None
    assert speeds([(100.0, 105.4)] * 500) is None
    assert speeds([(0.0, 0.53)] * 500) == AT_LIMIT


def test_drives_with_other_filters_read_one_speed() -> None:
    """A swing of 5 rad/s at 8 Hz, of which a filter of 20 ms leaves 0.7 and delays the rest."""

    def swing(cycle: int, lag_s: float) -> float:
        omega = 2.0 * math.pi * 8.0
        grown = 5.0 * min(1.0, cycle / 50.0)
        return grown / math.hypot(1.0, omega * lag_s) * math.sin(omega * cycle * PERIOD_S - math.atan(omega * lag_s))

    assert speeds([(swing(k, 0.0), swing(k, 0.02)) for k in range(500)]) is None


@pytest.mark.parametrize("factor", [1.0, 0.5, 0.0, -1.0])
def test_drives_that_answer_in_turn_are_compared(factor: float) -> None:
    """m1 at odd, m2 at even SYNCs, for 4 s: too short for their share to count as lost."""
    made = supervised()
    course = [(answer(0.0, factor * 20.0) if k % 2 else None, None if k % 2 else answer(0.0, 20.0)) for k in range(400)]
    pairs = ((DriveRecord(0.0, one, one is not None), DriveRecord(0.0, two, two is not None)) for one, two in course)
    assert (cycles_to_end(made, pairs) is None) is (factor == 1.0)


WRONG_SPEEDS: dict[str, Callable[[float], float]] = {
    "reversed": lambda speed: -speed,
    "zero": lambda speed: 0.0,
    "half": lambda speed: speed / 2,
    "stuck": lambda speed: 5.0,
}


@pytest.mark.parametrize("wrong", WRONG_SPEEDS)
def test_a_speed_that_is_wrong_on_one_drive_ends_the_run(wrong: str) -> None:
    made = supervised()
    course = [(WRONG_SPEEDS[wrong](0.05 * k), 0.05 * k) for k in range(400)]
    ended = speeds(course, made)
    assert ended is not None
    assert abs(course[ended - 1][1]) < 10.0
    assert "expected one speed within" in str(made.ended)


def test_a_speed_that_jumps_in_every_second_cycle_ends_it() -> None:
    assert (speeds([(40.0 * (k % 2), 40.0) for k in range(100)]) or math.inf) <= 20


def messages(*counts: int | tuple[int, int]) -> int | None:
    each = (count if isinstance(count, tuple) else (count, count) for count in counts)
    pair = ((DriveRecord(0.0, answer(), *count), DriveRecord(0.0, answer())) for count in each)
    return cycles_to_end(supervised(), pair)


def test_one_tpdo_per_sync() -> None:
    pair: list[int | tuple[int, int]] = [1, (1, 2)]
    assert messages(*[1] * 1000) is None
    assert messages(*[0, 2] * 500) is None, "each second is late"
    assert messages(*[0, *[1] * 9] * 500) is None, "a tenth is lost: their rows are flagged"
    assert 500 < (messages(*[1, 0] * 1000) or 0) < 520, "half of them are: a fifth of what counts after 5.1 s"
    assert 1300 < (messages(*[1, 1, 1, 0] * 1000) or 0) < 1700
    assert messages(*[1, 1, 2] * 500) == 3 * MOST_SURPLUS
    assert messages(*pair * 500) == 2 * MOST_SURPLUS, "one kind of two"
    assert messages(*([2] + [1] * 200) * 20) is None, "a controller that hears a frame twice"


def test_late_ones_are_awaited_for_as_long_as_feedback_may_be_old() -> None:
    for begins in range(80, 120):
        assert messages(0, *[1] * begins, *[0] * 12, 13, *[1] * 50) is None, "a drive that stops for 12 cycles"
    assert messages(*[0] * 5, *[1] * 14, *[2] * 5, *[1] * 50) is None
    assert messages(*[0] * 5, *[1] * 30, *[2] * 5) == 35 + MOST_SURPLUS, "these were lost"


def test_doubtful_rows_are_those_of_the_drive_that_is() -> None:
    made = supervised()

    def doubtful(m1_nm: float, m2: InverterFeedback, messages: int = 1) -> tuple[bool, bool]:
        one, other = DriveRecord(100.0, answer(m1_nm)), DriveRecord(0.0, m2, messages, messages)
        return made.take(CycleRecord(next(_noise), one, other))

    assert doubtful(100.0, answer()) == (False, False)
    assert doubtful(131.0, answer()) == (True, False)
    assert doubtful(100.0, answer(), messages=2) == (False, True)
    assert doubtful(100.0, answer(), messages=1) == (False, False)
    assert made.ended is None


def test_two_speeds_that_differ_make_both_doubtful() -> None:
    made = supervised()
    seen = [
        made.take(CycleRecord(k * PERIOD_NS, DriveRecord(0.0, answer(0.0, 0.0)), DriveRecord(0.0, answer(0.0, 20.0))))
        for k in range(3)
    ]
    assert seen[-1] == (True, True)


def test_what_does_not_come_is_judged_by_its_age() -> None:
    made = supervised()
    assert made.ages_ns(0) == (0, 0)
    made.take(CycleRecord(5, DriveRecord(0.0, None, 0, 0), DriveRecord(0.0, answer())))
    assert made.ages_ns(25) == (25, 20)
    made.raise_if_old((200_000_000, 0))
    with pytest.raises(DeviceTimeout, match=r"inverter m2: no TPDO for 0\.201 s, .* more than 0\.2 s"):
        made.raise_if_old((0, 201_000_000))


def test_the_first_end_is_kept() -> None:
    made = supervised()
    assert m1_alone(torques(*[500.0] * 3), made=made) == 1
    with pytest.raises(WrongTorque, match=r"^inverter m1: torque actual value 0x6077 is 500 Nm, expected 100 Nm as"):
        made.raise_if_ended()


def test_the_table_of_the_documentation_is_that_of_the_rules() -> None:
    page = (Path(__file__).parents[2] / "docs" / "reliability.md").read_text("utf-8")
    assert rules_table() in page


@pytest.mark.parametrize(("speed_rad_s", "is_doubtful"), [(1.2, False), (1.4, True)])
def test_speeds_may_differ_by_a_count_of_each_drive(speed_rad_s: float, is_doubtful: bool) -> None:
    """0.5 rad/s of noise, counts of 0.4 and 0.3 rad/s, and 5 % of the greater reading: 1.26 and 1.27 rad/s."""
    made = Supervision(SupervisionLimits(GUARD, 0.4, 0.3), M1, M2)
    for k in range(300):
        drives = [DriveRecord(0.0, answer(0.0, speed)) for speed in (speed_rad_s, 0.0)]
        doubts = made.take(CycleRecord(k * PERIOD_NS, *drives))
        if made.ended is not None:
            break
    assert doubts == (is_doubtful, is_doubtful)


def test_both_drives_are_doubtful_where_their_sum_is_wrong_and_neither_alone() -> None:
    made = supervised()
    drives = [DriveRecord(100.0, answer(125.0)) for _ in range(2)]
    assert made.take(CycleRecord(0, *drives)) == (True, True)
    assert supervised().take(CycleRecord(0, drives[0], DriveRecord(100.0, answer(100.0)))) == (False, False)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_speed_that_both_read_is_compared_with_what_both_torques_make_of_the_vehicle(sign: float) -> None:
    made, speed_rad_s = supervised(inertia_kg_m2=100.0), 0.0
    for k in range(3000):
        torque_nm = 100.0 if k // 500 % 2 else -100.0
        speed_rad_s += 2.0 * torque_nm / 100.0 * PERIOD_S
        drives = [DriveRecord(torque_nm, answer(torque_nm, sign * speed_rad_s)) for _ in range(2)]
        made.take(CycleRecord(k * PERIOD_NS, *drives))
        if made.ended is not None:
            break
    assert (made.ended is None) == (sign > 0.0), made.ended
