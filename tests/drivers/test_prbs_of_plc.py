"""Supervision of a PLC's PRBS: drives that follow it in their own way are healthy, one that does not ends the run."""

import itertools
import math
import re
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import pytest

from drivers.inverter.cia402 import TorqueMode
from drivers.inverter.drive_supervision import DriveRecord
from drivers.inverter.supervision import NO_PART, CycleRecord, PlcPart
from estimator.signals.prbs import Prbs
from tests.drivers.can_bench import M1
from tests.drivers.test_supervision import PERIOD_NS, PERIOD_S, answer, supervised


def with_plc(
    m1: Callable[[float], float],
    m2: Callable[[float], float],
    divider: int,
    part_nm: float = 60.0,
    is_on: bool = True,
    parts_nm: tuple[float, float] | None = None,
) -> tuple[str, int]:
    """Drives with 100 Nm each and a part of the PLC, of which each makes something; what ends 20 s of it, and when."""
    made, generator = supervised(), Prbs(1.0, 10, divider, 1)
    course = [generator.next() for _ in range(2000)]
    plc = PlcPart(*(parts_nm or (part_nm, part_nm)), is_on=True) if is_on else NO_PART
    for k, level in enumerate(course):
        drives = [DriveRecord(100.0, answer(100.0 + part_nm * of(level))) for of in (m1, m2)]
        made.take(CycleRecord(k * PERIOD_NS, *drives, plc))
        if made.ended is not None:
            return str(made.ended), k
    return "", len(course)


def same(level: float) -> float:
    return level


def later(cycles: int) -> Callable[[float], float]:
    kept = deque([0.0] * (cycles + 1), maxlen=cycles + 1)

    def of(level: float) -> float:
        kept.append(level)
        return kept[0]

    return of


def lagging(time_s: float) -> Callable[[float], float]:
    kept = [0.0]

    def of(level: float) -> float:
        kept[0] += (1.0 - math.exp(-PERIOD_S / time_s)) * (level - kept[0])
        return kept[0]

    return of


def in_turn() -> Callable[[float], float]:
    count = itertools.count()
    return lambda level: level if next(count) % 2 else -level


DIVIDERS = [1, 2, 5, 20]


@pytest.mark.parametrize("divider", DIVIDERS)
def test_drives_that_follow_the_prbs_of_the_plc_in_their_own_way_are_healthy(divider: int) -> None:
    for m2 in (same, later(1), later(3), lagging(0.02), lagging(0.06), lambda level: level + 0.4):
        assert with_plc(same, m2, divider) == ("", 2000)
    assert with_plc(lagging(0.02), lagging(0.03), divider) == ("", 2000)
    biased = with_plc(lambda level: level + 1.1, lambda level: level - 1.1, divider, part_nm=20.0)
    assert biased == ("", 2000)  # each is within its tolerance, by more than its part


@pytest.mark.parametrize("divider", DIVIDERS)
@pytest.mark.parametrize(
    "wrong",
    [
        lambda: lambda level: -level,
        lambda: lambda level: 0.0,
        lambda: lambda level: 1.0,
        in_turn,
        lambda: later(60),
    ],
    ids=["turned", "none", "stuck", "turned in each second cycle", "late"],
)
@pytest.mark.parametrize("part_nm", [60.0, 20.0])
def test_a_drive_that_does_not_follow_it_is_ended(
    divider: int, wrong: Callable[[], Callable[[float], float]], part_nm: float
) -> None:
    said, cycles = with_plc(same, wrong(), divider, part_nm)
    assert re.search("their torques 0x6077 do not go up and down together with the PLC's own PRBS, got a corr", said)
    assert cycles < 200 * divider if divider < 20 else cycles < 2000


def test_a_part_whose_turn_is_within_the_tolerance_is_not_compared() -> None:
    assert with_plc(same, lambda level: -level, 2, part_nm=14.0) == ("", 2000)
    assert with_plc(same, lambda level: 0.0, 2, parts_nm=(60.0, 0.0)) == ("", 2000)  # all of it at m1


@pytest.mark.parametrize("divider", DIVIDERS)
@pytest.mark.parametrize("wrong", [lambda k: 300.0, lambda k: 300.0 * (k % 2), lambda k: -300.0 * (k % 3 == 0)])
def test_beyond_what_the_plc_may_add_each_cycle_counts(divider: int, wrong: Callable[[int], float]) -> None:
    count = itertools.count()
    said, cycles = with_plc(lambda level: level + wrong(next(count)) / 60.0, same, divider)
    assert "expected 40 to 160 Nm as commanded and up to 60 Nm of the PLC either way, within 30 Nm" in said
    assert cycles < 8


def test_a_drive_that_does_not_answer_as_the_generator_is_switched_on_is_compared_when_it_does() -> None:
    made = supervised()
    for k, (is_on, is_lost) in enumerate([(False, False), (True, True), (True, False)]):
        m1 = DriveRecord(100.0, answer(160.0))
        m2 = DriveRecord(100.0, None if is_lost else answer(160.0 + 0.1 * k))
        made.take(CycleRecord(k * PERIOD_NS, m1, m2, PlcPart(60.0, 60.0, is_on)))
    assert made.ended is None


def test_a_slope_is_no_other_level_of_the_plc() -> None:
    """A torque on its way to a command that has jumped is below or above it, whatever level the PLC has."""
    sloped = replace(M1, mode=TorqueMode.PROFILE_TORQUE, torque_slope_nm_per_s=700.0)
    made, generator = supervised(sloped), Prbs(1.0, 10, 3, 1)
    step_nm, ramp_nm = 700.0 * PERIOD_S, 0.0
    for k in range(1000):
        target_nm = 300.0 if k // 100 % 2 else -300.0
        ramp_nm += min(max(target_nm - ramp_nm, -step_nm), step_nm)
        level = generator.next()
        m1, m2 = DriveRecord(target_nm, answer(ramp_nm + 60.0 * level)), DriveRecord(0.0, answer(60.0 * level))
        made.take(CycleRecord(k * PERIOD_NS, m1, m2, PlcPart(60.0, 60.0, is_on=True)))
    assert made.ended is None


def test_a_prbs_of_the_plc_that_is_confirmed_off_widens_nothing() -> None:
    said, _ = with_plc(lambda level: 1.0, lambda level: 1.0, 2, is_on=False)
    assert "expected 200 Nm as commanded, within 42" in said
