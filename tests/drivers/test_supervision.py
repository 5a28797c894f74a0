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
from drivers.inverter.feedback import InverterFeedback
from drivers.inverter.settings import InverterSettings
from drivers.inverter.supervision import (
    MOST_MISSING,
    MOST_SURPLUS,
    NO_TORQUE_COUNTS,
    NO_TORQUE_S,
    RUNAWAY_RAD_S,
    RUNAWAY_SHARE,
    SPEED_NOISE_RAD_S,
    SPEED_SHARE,
    SURPLUS_CYCLES,
    UNWOUND_S,
    CycleRecord,
    DriveRecord,
    Supervision,
    SupervisionLimits,
)
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
    return Supervision(SupervisionLimits(replace(GUARD, error=error), 0.0, 0.0, inertia_kg_m2), settings, M2)


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
    assert m1_alone(torques(*[1.3] * 500, limited=True)) is None
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
    assert abs(course[ended - 1][1]) < 2.0
    assert "expected one speed within" in str(made.ended)


def test_a_speed_that_jumps_in_every_second_cycle_ends_it() -> None:
    assert (speeds([(40.0 * (k % 2), 40.0) for k in range(100)]) or math.inf) <= 6


def test_quick_changes_of_both_are_no_difference() -> None:
    """100 rad/s² sampled a period apart: 1 rad/s."""
    assert speeds([(1.0 * k, 1.0 * (k + 1)) for k in range(-50, 50)]) is None


def test_a_speed_that_runs_away_against_the_torque_ends_it() -> None:
    def run(share: float, torque_nm: float = 100.0) -> int | None:
        made = supervised(inertia_kg_m2=10.0)
        speed = [share * torque_nm / 10.0 * PERIOD_S * k for k in range(300)]
        seen = ((DriveRecord(torque_nm, answer(torque_nm, w)), DriveRecord(0.0, answer(0.0, w))) for w in speed)
        return cycles_to_end(made, seen)

    assert run(-1.0) == 20 + round(UNWOUND_S / PERIOD_S)
    assert run(1.0) is None
    assert run(-0.45) is None, "a grade that is steeper than the torque"


@pytest.mark.parametrize("size_nm", [100.0, 500.0, 2000.0])
@pytest.mark.parametrize("from_rad_s", [0.0, 0.4, 0.9, 1.4, 2.6])
def test_a_shaft_that_unwinds_when_the_torque_turns_is_no_vehicle_that_runs_away(
    size_nm: float, from_rad_s: float
) -> None:
    """Motor of 2 kg m² and load of 83 kg m² on a shaft of 3500 Nm/rad, in steps of 1 ms."""

    def run(sign: float) -> int | None:
        speed, seen = [from_rad_s, from_rad_s], []
        twist = -size_nm / 3500.0
        for step in range(4400):
            torque_nm = -size_nm if step < 400 else size_nm
            if step % 10 == 0:
                read = answer(torque_nm, sign * speed[0])
                seen.append((DriveRecord(torque_nm, read), DriveRecord(0.0, answer(0.0, sign * speed[0]))))
            shaft_nm = 3500.0 * twist + 9.0 * (speed[0] - speed[1])
            speed[0] += 0.001 * (torque_nm - shaft_nm) / 2.0
            speed[1] += 0.001 * shaft_nm / 83.0
            twist += 0.001 * (speed[0] - speed[1])
        wide = replace(ERROR, m1_nm=1e5, sum_nm=1e5)  # torques are not what is judged here
        return cycles_to_end(supervised(error=wide, inertia_kg_m2=85.0), seen)

    assert run(1.0) is None
    assert run(-1.0) is not None


SWINGING = """
-532 -5.42  -532 -6.19  -291 -6.00  -261 -3.80  -472 -1.27  -442 -0.52  -411 -0.41  -382 -0.65  -112 -1.52  -82 -1.09
-292 -1.07  -262 -2.77  8 -4.40  38 -4.05  68 -3.30  98 -2.45  128 -1.62  158 -1.12  -52 -0.99  -22 -2.58  8 -4.12
38 -5.18  68 -5.51  98 -4.91  128 -3.86  158 -2.48  429 -1.20  458 1.03  248 2.24  269 0.77  509 -1.31  509 -2.33
509 -3.27  509 -4.19  509 -4.60  509 -4.55  509 -4.02  509 -3.29  269 -2.30  269 -2.83  509 -3.25  509 -2.18  269 -1.16
268 -1.90  509 -2.69  509 -2.03  268 -1.39  269 -2.48  509 -3.44  510 -2.51  269 -1.59  269 -2.36  509 -2.91  509 -1.82
269 -0.82  269 -1.53  509 -2.37  509 -1.63  509 -0.91  509 -0.50  509 -0.51  509 -0.64  509 -1.09  508 -1.61  509 -1.99
509 -2.37  509 -2.38  509 -2.25  509 -1.74  509 -1.08  509 -0.70  508 -0.20  269 -0.23  269 -1.66  509 -2.99
"""
"""Torque [Nm] and motor speed [rad/s] of a simulated bus of 100 kg m², cycle by cycle: a reversal of 400 Nm with a PRBS
of 120 Nm. The motor swings on its shaft at 8 Hz and beyond zero while the vehicle slows down."""


def test_a_motor_that_swings_on_its_shaft_does_not_run_away() -> None:
    torque_nm, speed = ([float(word) for word in SWINGING.split()[first::2]] for first in (0, 1))
    halves = zip((0.5 * torque for torque in torque_nm), speed, strict=True)
    seen = ((DriveRecord(half, answer(half, w)), DriveRecord(half, answer(half, w))) for half, w in halves)
    assert cycles_to_end(supervised(inertia_kg_m2=100.0), seen) is None


def messages(*counts: int | tuple[int, int]) -> int | None:
    each = (count if isinstance(count, tuple) else (count, count) for count in counts)
    pair = ((DriveRecord(0.0, answer(), *count), DriveRecord(0.0, answer())) for count in each)
    return cycles_to_end(supervised(), pair)


def test_one_tpdo_per_sync() -> None:
    pair: list[int | tuple[int, int]] = [1, (1, 2)]
    assert messages(*[1] * 1000) is None
    assert messages(*[1, 0] * 500) is None, "each second is lost: its row is flagged"
    assert messages(*[0, 2] * 500) is None, "each second is late"
    assert messages(*[1, 1, 2] * 500) == 3 * MOST_SURPLUS
    assert messages(*pair * 500) == 2 * MOST_SURPLUS, "one kind of two"
    assert messages(*([2] + [1] * 200) * 20) is None, "a controller that hears a frame twice"
    assert messages(*[1, 0, 0] * 500) == 3 * (MOST_MISSING - 1)


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
    assert doubtful(100.0, answer(0.0, 0.9)) == (True, True)
    assert doubtful(100.0, answer(), messages=1) == (False, False)
    assert made.ended is None


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


def test_the_table_of_the_documentation_has_the_numbers_of_the_rules() -> None:
    page = (Path(__file__).parents[2] / "docs" / "reliability.md").read_text("utf-8")
    for rule in (
        f"a torque above {NO_TORQUE_COUNTS} counts | `torque_error_nm` | tolerance × {NO_TORQUE_S:g} s |",
        f"| {SPEED_NOISE_RAD_S:g} rad/s, a count of each, {100 * SPEED_SHARE:g} %, and its change in two periods |",
        f"| {RUNAWAY_SHARE:g} of what they can give the inertia | torque for {RUNAWAY_RAD_S:g} rad/s |",
        f"| {MOST_SURPLUS} too many within {SURPLUS_CYCLES} cycles; {MOST_MISSING} more missing than coming |",
    ):
        assert rule in page
