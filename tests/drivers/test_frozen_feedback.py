"""Feedback that does not change: distinguished from a quiet machine and from a slow one."""

from __future__ import annotations

import itertools

import pytest

from drivers.errors import DeviceFault
from drivers.inverter.cia402 import PowerState
from drivers.inverter.feedback import InverterFeedback
from drivers.inverter.frozen_feedback import MOST_STEPS, STEP_PERMILLE, FrozenFeedback

_sequence = itertools.count(1)


def feedback(torque_raw: int, speed_raw: int = 1000) -> InverterFeedback:
    """The next TPDO, with these values."""
    return InverterFeedback(0.0, 0.0, PowerState.OPERATION_ENABLED, 0, next(_sequence), torque_raw, speed_raw)


def alternating(
    made: FrozenFeedback, steps: int, torque_raw: int, speed_raw: int = 1000, size: int = STEP_PERMILLE
) -> None:
    """So many commands up and down, with a TPDO of the same values before each."""
    for k in range(steps):
        made.commanded(size * (k % 2), feedback(torque_raw, speed_raw))


def test_feedback_that_stands_still_while_the_command_steps_is_a_fault() -> None:
    made = FrozenFeedback("inverter m1")
    alternating(made, MOST_STEPS, 7)
    made.raise_if_frozen()
    alternating(made, 2, 7)
    with pytest.raises(DeviceFault, match=r"inverter m1: feedback stands still at torque 0x6077 = 7 .*power-cycle"):
        made.raise_if_frozen()


@pytest.mark.parametrize("changed", [(8, 1000), (7, 1001)])
def test_one_count_of_torque_or_speed_is_life(changed: tuple[int, int]) -> None:
    made = FrozenFeedback("inverter m1")
    for _ in range(5):
        alternating(made, MOST_STEPS - 1, 7)
        alternating(made, 1, *changed)
    made.raise_if_frozen()


@pytest.mark.parametrize("size", [0, STEP_PERMILLE - 1])
def test_a_command_that_stands_still_tells_nothing(size: int) -> None:
    made = FrozenFeedback("inverter m1")
    alternating(made, 1000, 7, size=size)
    made.raise_if_frozen()


@pytest.mark.parametrize("latest", [None, feedback(7)])
def test_feedback_that_does_not_come_is_not_for_this_to_judge(latest: InverterFeedback | None) -> None:
    made = FrozenFeedback("inverter m1")
    for k in range(1000):
        made.commanded(STEP_PERMILLE * (k % 2), latest)
    made.raise_if_frozen()


def test_another_run_begins_anew() -> None:
    made = FrozenFeedback("inverter m1")
    alternating(made, 2 * MOST_STEPS, 7)
    made.start_anew()
    made.raise_if_frozen()
