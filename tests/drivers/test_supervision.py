"""What a drive gives against what it was commanded: double, nothing, an offset the reverse; and what is no fault."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import pytest

from drivers.errors import CommandRefused, WrongTorque
from drivers.torque_error import Measured, TorqueError
from drivers.torque_guard import ErrorLimits, TorqueGuard, TorqueRequest
from estimator.signals.prbs import Prbs
from tests.drivers.can_bench import FRESH, guard_limits

LIMITS = ErrorLimits(m1_nm=30.0, m2_nm=30.0, sum_nm=math.hypot(30.0, 30.0), time_s=0.12, response_s=0.01)
PERIOD_S = 0.01
MS = 1_000_000
PERIOD_NS = 10 * MS
NOTICED_S = 0.3
"""What issue and manual promise."""

Drive = Callable[[list[float]], float]
"""Gives its torque from its commands so far [Nm]."""


def steady(cycle: int) -> float:
    return 100.0


def prbs(divider: int) -> Callable[[int], float]:
    levels = Prbs(60.0, 10, divider, 1)
    course = [levels.next() for _ in range(3000)]
    return lambda cycle: course[cycle]


def ramp(cycle: int) -> float:
    """2000 Nm/s, up and down again."""
    return 20.0 * (20 - abs(cycle % 40 - 20))


def around_a_torque(cycle: int) -> float:
    return 100.0 + QUICK(cycle)


QUICK = prbs(1)
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
    "off by less than the limit": lambda commands: commands[-1] + 29.9,
    "3 % too much": lambda commands: 1.03 * commands[-1],
}


def cycles_until_fault(course: Callable[[int], float], drive: Drive, start: int = 0, limit: int = 2000) -> int | None:
    """Run one inverter after the other, m2 at rest; how long until it is noticed."""
    error, commands = TorqueError(LIMITS, PERIOD_S), [0.0]
    for cycle in range(limit):
        commands.append(course(start + cycle))
        error.commanded(commands[-1], 0.0)
        try:
            error.compare(cycle * PERIOD_NS, Measured(drive(commands)), Measured(0.0))
        except WrongTorque:
            return cycle + 1
    return None


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_drive_is_noticed_in_time(course: str, wrong: str) -> None:
    for start in range(0, 1000, 7):
        noticed = cycles_until_fault(COURSES[course], WRONG[wrong], start, limit=100)
        assert noticed is not None
        assert noticed * PERIOD_S <= NOTICED_S, f"from cycle {start}"


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("right", RIGHT)
def test_a_drive_that_follows_is_left_alone(course: str, right: str) -> None:
    assert cycles_until_fault(COURSES[course], RIGHT[right]) is None


def compare(
    m1_nm: list[float], m2_nm: list[float] | None = None, command_nm: float = 100.0, limited: bool = False
) -> int | None:
    """Hold a command and let these readings come; the first that is a fault."""
    error = TorqueError(LIMITS, PERIOD_S)
    m2 = m2_nm or [command_nm] * len(m1_nm)
    for cycle, (first, second) in enumerate(zip(m1_nm, m2, strict=True)):
        error.commanded(command_nm, command_nm)
        try:
            error.compare(cycle * PERIOD_NS, Measured(first, limited), Measured(second))
        except WrongTorque:
            return cycle
    return None


FAULT_AT = round(LIMITS.time_s / PERIOD_S)
"""So many samples outside are a fault."""


def test_the_limit_itself_is_allowed_and_a_hair_more_is_not() -> None:
    for sign in (1.0, -1.0):
        assert compare([100.0 + sign * 30.0] * 50) is None
        assert compare([100.0 + sign * 30.001] * 50) == FAULT_AT - 1


def test_each_inverter_is_compared_with_its_own_limit() -> None:
    error = TorqueError(ErrorLimits(10.0, 20.0, 1000.0, 0.01, 0.01), PERIOD_S)
    error.commanded(0.0, 0.0)
    error.compare(0, Measured(10.0), Measured(20.0))
    with pytest.raises(WrongTorque, match=r"^inverter m1: torque actual value 0x6077 is 10\.1 Nm, expected 0 Nm as"):
        error.compare(0, Measured(10.1), Measured(20.0))
    with pytest.raises(WrongTorque, match=r"^inverter m2: torque actual value 0x6077 is 20\.1 Nm"):
        error.compare(10 * PERIOD_NS, Measured(10.0), Measured(20.1))


def test_both_together_have_a_limit_below_the_sum_of_theirs() -> None:
    assert compare([122.0] * 50, [122.0] * 50) == FAULT_AT - 1
    assert compare([121.0] * 50, [121.0] * 50) is None
    assert compare([129.0] * 50, [71.0] * 50) is None, "opposite errors turn no shaft"


def test_short_and_seldom_is_no_fault_often_is() -> None:
    outside, inside = [200.0], [100.0]
    assert compare((FAULT_AT - 1) * outside + 200 * inside) is None
    assert compare(100 * (outside + 2 * inside)) is None
    assert compare(100 * (2 * outside + 2 * inside)) is not None


def test_a_drive_that_says_it_is_limited_may_give_less_and_no_more() -> None:
    assert compare([0.0] * 50, limited=True) is None
    assert compare([-30.0] * 50, limited=True) is None
    assert compare([131.0] * 50, limited=True) == FAULT_AT - 1
    assert compare([-31.0] * 50, limited=True) == FAULT_AT - 1


def test_an_old_reading_says_nothing_while_the_command_changes() -> None:
    """A drive too slow for its SYNC repeats its last TPDO; one that stands still is for `FrozenFeedback`."""
    error = TorqueError(LIMITS, PERIOD_S)
    for cycle in range(1000):
        error.commanded(60.0 * (-1) ** (cycle // 2), 0.0)
        error.compare(cycle * PERIOD_NS, Measured(100.0, repeated=True), Measured(0.0))
    held = [(1000 + k) * PERIOD_NS for k in range(FAULT_AT + 3)]

    def hold() -> None:
        for t_ns in held:
            error.commanded(60.0, 0.0)
            error.compare(t_ns, Measured(100.0, repeated=True), Measured(0.0))

    with pytest.raises(WrongTorque):
        hold()


def test_a_quick_prbs_around_zero_that_is_turned_round_is_noticed_later() -> None:
    """Levels of one cycle: it differs from a drive that samples a cycle later where three in a row are the same."""
    noticed = [cycles_until_fault(QUICK, WRONG["reverse"], start, limit=300) for start in range(0, 1000, 7)]
    assert max(each or math.inf for each in noticed) * PERIOD_S <= 1.0


def test_no_answer_is_no_torque_error() -> None:
    error = TorqueError(LIMITS, PERIOD_S)
    error.compare(0, Measured(500.0), None)  # before the first command nothing can be said
    for cycle in range(100):
        error.commanded(100.0, 100.0)
        error.compare(cycle * PERIOD_NS, None, Measured(100.0))
        error.compare(cycle * PERIOD_NS, Measured(100.0), None)


def test_the_guard_falls_silent_at_a_wrong_torque() -> None:
    guard = TorqueGuard(guard_limits(50.0, 1e6))
    guard.enable()
    guard.check(TorqueRequest(0.0, 0.0, 0.0, 0.0), 0, FRESH)
    guard.compare(0, Measured(50.0), Measured(0.0))
    assert guard.enabled
    with pytest.raises(WrongTorque, match="does not give what it is asked for"):
        guard.compare(0, Measured(51.0), Measured(0.0))
    assert not guard.enabled
    with pytest.raises(CommandRefused, match="not enabled"):
        guard.check(TorqueRequest(0.0, 1.0, 0.0, 0.0), 0, FRESH)


def test_a_torque_nobody_asked_for_is_noticed_before_the_guard_is_enabled() -> None:
    guard = TorqueGuard(guard_limits(50.0))
    guard.check(TorqueRequest(0.0, 0.0, 0.0, 0.0), 0, FRESH)
    with pytest.raises(WrongTorque, match="expected 0 Nm as commanded"):
        guard.compare(0, Measured(51.0), Measured(0.0))


def run_of(held: list[int], limits: ErrorLimits = LIMITS) -> int | None:
    """Let a drive turn a square of 100 Nm round whose levels are held for so many cycles; samples until the fault."""
    error = TorqueError(limits, PERIOD_S)
    levels = [100.0 * (-1) ** k for k, length in enumerate(held) for _ in range(length)]
    for cycle, level_nm in enumerate(levels):
        error.commanded(level_nm, 0.0)
        try:
            error.compare(cycle * PERIOD_NS, Measured(-level_nm), Measured(0.0))
        except WrongTorque:
            return cycle + 1
    return None


def test_both_ways_of_sampling_have_to_fail_one_of_them_for_half_the_time() -> None:
    """Levels of two cycles fail the first way alone, by one sample in two; the third cycle of a level fails both."""
    most = round(LIMITS.time_s / PERIOD_S)
    assert most == 12
    assert run_of([2] * 200) is None
    assert run_of([2] * 12 + [3] * 20) == 2 * 12 + 3 * (most // 2)


def test_what_is_as_old_as_the_window_counts_no_more() -> None:
    limits = ErrorLimits(30.0, 30.0, 1000.0, time_s=0.05, response_s=0.01)  # five samples within 125 ms
    for last_ms, is_fault in ((124, True), (125, False)):
        error = TorqueError(limits, PERIOD_S)
        error.commanded(0.0, 0.0)
        for t_ms in (0, 10, 20, 30):
            error.compare(t_ms * MS, Measured(100.0), Measured(0.0))
        if is_fault:
            with pytest.raises(WrongTorque):
                error.compare(last_ms * MS, Measured(100.0), Measured(0.0))
        else:
            error.compare(last_ms * MS, Measured(100.0), Measured(0.0))


@pytest.mark.parametrize(("response_s", "late", "is_fault"), [(0.03, 4, False), (0.03, 6, True), (0.004, 2, False)])
def test_a_drive_may_take_its_response_time_and_no_longer(response_s: float, late: int, is_fault: bool) -> None:
    """A square of 100 Nm whose levels are held for seven cycles, followed so many cycles late."""
    error = TorqueError(ErrorLimits(30.0, 30.0, 1000.0, 0.12, response_s), PERIOD_S)
    course = [100.0 * (-1) ** (k // 7) for k in range(300)]

    def follow() -> None:
        for cycle, level_nm in enumerate(course):
            error.commanded(level_nm, 0.0)
            error.compare(cycle * PERIOD_NS, Measured(course[max(0, cycle - late)]), Measured(0.0))

    if is_fault:
        with pytest.raises(WrongTorque):
            follow()
    else:
        follow()


@pytest.mark.parametrize("old", ["m1", "m2"])
def test_one_old_reading_makes_the_sum_an_old_one(old: str) -> None:
    error = TorqueError(ErrorLimits(1000.0, 1000.0, 30.0, 0.12, 0.01), PERIOD_S)
    for cycle in range(200):
        error.commanded(60.0 * (-1) ** (cycle // 2), 0.0)
        error.compare(cycle * PERIOD_NS, Measured(200.0, repeated=old == "m1"), Measured(200.0, repeated=old == "m2"))


def test_the_message_has_the_commands_of_a_drive_that_samples_at_once() -> None:
    error = TorqueError(ErrorLimits(30.0, 1000.0, 1000.0, 0.12, 0.01), PERIOD_S)

    def ramp_up() -> None:
        for cycle in range(20):
            error.commanded(10.0 * cycle, 0.0)
            error.compare(cycle * PERIOD_NS, Measured(500.0), Measured(0.0))

    with pytest.raises(WrongTorque, match=r"is 500 Nm, expected 100 to 110 Nm as commanded, within 30 Nm"):
        ramp_up()


def test_a_reading_can_t_be_changed() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        Measured(1.0).torque_nm = 2.0  # type: ignore[misc]
