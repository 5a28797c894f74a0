"""Whether a drive follows its target torque, by its own word: statusword bit 12 in cyclic synchronous torque mode.

A drive may be in OPERATION ENABLED and ignore the target (CiA 402-2, table "Statusword bits in cst mode"): while it
magnetises its motor, while a limit switch or a maker's own function holds it. Its readings are noise around zero then,
so that nothing else shows it.
"""

from __future__ import annotations

from typing import Final

from drivers.errors import DeviceFault
from drivers.inverter.cia402 import PowerState, TorqueMode
from drivers.inverter.feedback import InverterFeedback
from drivers.inverter.settings import InverterSettings

MOST_IGNORED: Final = 10
"""So many TPDOs in a row without bit 12 are no passing thing, once the drive has followed or is asked for a torque."""

NS_PER_S: Final = 1_000_000_000


class FollowWatch:
    """Watches bit 12 of one drive's TPDOs.

    Parameters
    ----------
    settings
        Its mode, its time-outs, and whether it has the bit.
    """

    __slots__ = ("_asked", "_followed", "_ignored", "_sequence", "_settings", "_since_ns", "_watches")

    def __init__(self, settings: InverterSettings) -> None:
        self._settings = settings
        self._watches = settings.mode is TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE and settings.follow_bit
        self.start_anew()

    def follows(self, latest: InverterFeedback | None) -> bool:
        """Whether the drive has said that it follows since it was armed; True where it can't say."""
        return self._followed or not self._watches or (latest is not None and latest.follows)

    def is_ignored(self, latest: InverterFeedback) -> bool:
        """Whether feedback says that the target is not followed; False where the drive can't say."""
        return self._watches and not latest.follows

    def start_anew(self) -> None:
        """Forget what was seen: the drive has been armed."""
        self._asked = False
        self._followed = False
        self._ignored = 0
        self._sequence = 0
        self._since_ns: int | None = None

    def commanded(self, torque_raw: int) -> None:
        """Take a command: the time a drive may take before it follows is one at zero torque."""
        if torque_raw and not self._asked:
            self._asked, self._ignored = True, 0

    def raise_if_ignored(self, latest: InverterFeedback | None) -> None:
        """Judge by the last feedback.

        Raises
        ------
        DeviceFault
            If a drive in operation does not begin to follow in its time for a change of state, or follows no more, or
            does not follow a torque.
        """
        if not self._watches or latest is None or latest.sequence == self._sequence:
            return
        self._sequence = latest.sequence
        if latest.follows or latest.state is not PowerState.OPERATION_ENABLED:
            self._followed |= latest.follows
            self._ignored, self._since_ns = 0, None
            return
        self._ignored += 1
        self._since_ns = latest.t_ns if self._since_ns is None else self._since_ns
        if self._patience_is_over(latest.t_ns - self._since_ns):
            raise DeviceFault(
                f"{self._settings.where}: statusword 0x6041 bit 12 is 0 in the last {self._ignored} TPDOs, expected 1: "
                f"in mode {self._settings.mode.title} the drive ignores the target torque. Look for what holds it "
                "(enable inputs, safe torque off, limits); for a drive that has no such bit write follow_bit = false "
                "into the rig file."
            )

    def _patience_is_over(self, for_ns: int) -> bool:
        if self._followed or self._asked:
            return self._ignored >= MOST_IGNORED
        return for_ns > self._settings.state_timeout_s * NS_PER_S
