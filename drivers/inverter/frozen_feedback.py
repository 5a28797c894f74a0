"""Feedback that arrives and does not change: a drive whose program stands still while its CAN controller sends on.

A TPDO carries no time. But a torque that follows its command can't be the same to the last bit, and the speed with
it, while the command steps up and down.
"""

from __future__ import annotations

from typing import Final

from drivers.errors import DeviceFault
from drivers.inverter.feedback import InverterFeedback

STEP_PERMILLE: Final = 10
"""A change of the command that a torque reading shows: ten of its steps [per mille of rated torque]."""

MOST_STEPS: Final = 10
"""So many changes of the command that the feedback does not answer are no chance."""


class FrozenFeedback:
    """Counts the steps of the command that the feedback has not answered.

    Parameters
    ----------
    where
        Device, for messages.
    """

    __slots__ = ("_command", "_seen", "_sequence", "_steps", "_where")

    def __init__(self, where: str) -> None:
        self._where = where
        self._command = 0
        self._sequence = 0
        self._seen: tuple[int, int] | None = None
        self._steps = 0

    def start_anew(self) -> None:
        """Forget what was counted: another run."""
        self._seen, self._steps = None, 0

    def commanded(self, torque_raw: int, latest: InverterFeedback | None) -> None:
        """Take a command, and the feedback there is before it.

        Parameters
        ----------
        torque_raw
            Base and PRBS together [per mille of rated torque].
        latest
            The last feedback.
        """
        stepped = abs(torque_raw - self._command) >= STEP_PERMILLE
        self._command = torque_raw
        if latest is None or latest.sequence == self._sequence:
            return  # nothing has come, which is for others to judge
        self._sequence = latest.sequence
        seen = (latest.torque_raw, latest.speed_raw)
        if seen != self._seen:
            self._seen, self._steps = seen, 0
        elif stepped:
            self._steps += 1

    def raise_if_frozen(self) -> None:
        """Judge.

        Raises
        ------
        DeviceFault
            If the feedback stood still through `MOST_STEPS` steps of the command.
        """
        if self._steps >= MOST_STEPS and self._seen is not None:
            torque, speed = self._seen
            raise DeviceFault(
                f"{self._where}: feedback stands still at torque 0x6077 = {torque} and speed 0x606C = {speed} counts "
                f"through {self._steps} steps of the command, expected a torque that follows. The drive sends old "
                "values: check its program, and power-cycle it."
            )
