"""Feedback once per SYNC: twice and every third time are noticed, a lost one here and there is not."""

from __future__ import annotations

import pytest

from drivers.errors import DeviceFault
from drivers.message_rate import CYCLES, MessageRate


def run(per_cycle: list[int]) -> None:
    rate, count = MessageRate("inverter m1 (node 1)"), 0
    for got in per_cycle:
        count += got
        rate.take(count)


@pytest.mark.parametrize("pattern", [[1], [1, 1, 0], [1, 0], [1, 2], [1, 1, 1, 2]])
def test_about_one_a_cycle_is_well(pattern: list[int]) -> None:
    run(pattern * (4 * CYCLES))


@pytest.mark.parametrize(
    ("pattern", "shown"), [([2], "2 TPDOs"), ([1, 0, 0], r"0\.3[24] TPDOs"), ([2, 1, 2], r"1\.6[68] TPDOs")]
)
def test_twice_or_every_third_time_is_not(pattern: list[int], shown: str) -> None:
    with pytest.raises(DeviceFault, match=rf"inverter m1 \(node 1\): {shown} per SYNC in the last {CYCLES} cycles"):
        run(pattern * (2 * CYCLES))


def test_nothing_is_said_before_there_are_enough_cycles() -> None:
    run([0] * CYCLES)
    with pytest.raises(DeviceFault):
        run([0] * (CYCLES + 1))
