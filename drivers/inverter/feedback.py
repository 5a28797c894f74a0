"""An inverter's TPDOs turned into feedback, and the waiting for it.

Where several share the feedback it is as old as the oldest of them: who waits for what came after a SYNC gets it when
all of that cycle are there.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.canopen.pdo_map import PdoCodec
from drivers.inverter.cia402 import PowerState, StatusBit, state_of
from drivers.inverter.tpdos import TpdoReceiver
from drivers.scaling import TorqueScale, VelocityScale

_LIMITED, _FOLLOWS = StatusBit.INTERNAL_LIMIT_ACTIVE.value, StatusBit.FOLLOWS_TARGET.value
"""As plain numbers, for one statusword in every cycle."""


@dataclass(frozen=True, slots=True)
class InverterFeedback:
    """What an inverter reported in its TPDOs.

    Attributes
    ----------
    torque_nm
        Torque actual value, 0x6077 [Nm].
    speed_rad_s
        Velocity actual value, 0x606C [rad/s].
    state
        Power state from the statusword, 0x6041.
    t_ns
        Arrival on the host's monotonic clock, of the TPDO that came first where there are several [ns].
    sequence
        Counts what was received from this inverter, from 1.
    torque_raw, speed_raw
        The counts on the bus, so that a wrong scale can be corrected later.
    limited
        Statusword bit 11: a limit of the drive's own acts, and the torque is not what was asked for.
    follows
        Statusword bit 12, which says in cyclic synchronous torque mode that the target torque is followed.
    """

    torque_nm: float
    speed_rad_s: float
    state: PowerState
    t_ns: int
    sequence: int
    torque_raw: int
    speed_raw: int
    limited: bool = False
    follows: bool = True


class FeedbackReceiver(TpdoReceiver):
    """Hands the latest feedback of one inverter to the caller's thread.

    Parameters
    ----------
    codecs
        The TPDOs' layouts; together they must carry 0x6041, 0x6077 and 0x606C.
    torque, velocity
        Scales of 0x6077 and 0x606C.

    Raises
    ------
    ConfigMismatch
        If one of the objects is in none of them.
    """

    def __init__(self, codecs: Sequence[PdoCodec], torque: TorqueScale, velocity: VelocityScale) -> None:
        super().__init__(codecs)
        self._torque = torque
        self._velocity = velocity
        self._places = tuple(self._place(index) for index in (0x6041, 0x6077, 0x606C))
        self._counts = [0] * len(self._codecs)
        self._sequence = 0
        self.latest: InverterFeedback | None = None

    @property
    def received(self) -> int:
        """How often all TPDOs have come; it never starts anew."""
        return min(self._counts)

    def _take(self, part: int) -> None:
        """Make feedback of the TPDOs, once each has come.

        Raises
        ------
        ProtocolViolation
            If the statusword is no state.
        """
        self._counts[part] += 1
        received = [each for each in self._received if each is not None]
        if len(received) < len(self._codecs):
            return
        statusword, torque_raw, speed_raw = (received[n].values[at] for n, at in self._places)
        self.latest = InverterFeedback(
            torque_nm=self._torque.to_nm(torque_raw),
            speed_rad_s=self._velocity.to_rad_s(speed_raw),
            state=state_of(statusword),
            t_ns=min(each.t_ns for each in received),
            sequence=self._sequence + 1,
            torque_raw=torque_raw,
            speed_raw=speed_raw,
            limited=bool(statusword & _LIMITED),
            follows=bool(statusword & _FOLLOWS),
        )
        self._sequence = self.latest.sequence

    def _forget(self) -> None:
        self.latest = None

    def await_after(self, after_ns: int, timeout_s: float) -> InverterFeedback | None:
        """Wait for feedback that arrived after ``after_ns`` [ns]; None if there is none in time."""
        latest = self.latest
        if latest is not None and latest.t_ns > after_ns:
            return latest
        deadline = time.monotonic() + timeout_s
        with self._arrived:
            while self.latest is None or self.latest.t_ns <= after_ns:
                if not self._arrived.wait(deadline - time.monotonic()):
                    return None
            return self.latest
