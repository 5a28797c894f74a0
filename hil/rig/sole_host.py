"""One host on a bus: this program listens before its first command, and lets the bus know that it is there.

CAN hands no node its own frames, so what arrives of a host's frames is another host's::

    listen   at least `LISTEN_S`, ten SYNC periods, and the longest heartbeat of the rig file, and up to `APART_S` more,
             drawn at random. SYNC, an NMT command, a host's heartbeat, an RPDO or an SDO request to a drive: somebody
             else is at work; refused
    ask      each drive for its statusword, by SDO: a drive that may carry torque is driven, whoever does it
    claim    a host that is going to command sends its heartbeat from now on, and listens on for `SETTLE_S`

Of two hosts that begin at once at most one drives. Let A's first heartbeat be the earlier. B listens for longer than
A's heartbeats are apart, until `SETTLE_S` after its own first one: it hears A. Two whose first frames go out within a
frame's time hear each other, and both give up.
"""

from __future__ import annotations

import random
import threading
from functools import partial
from typing import Final

from drivers.canopen.can_link import SYNC_COB_ID, CanLink
from drivers.canopen.heartbeat import HEARTBEAT_COB_ID, NMT_COB_ID
from drivers.errors import ForeignController, ProtocolViolation
from drivers.inverter.cia402 import TORQUE_STATES, PowerState, state_of
from hil.config.rig_file import Rig
from hil.simulator.addresses import IN_PROCESS

LISTEN_S: Final = 1.0
"""Listened at least, for hosts with another rig file [s]."""

APART_S: Final = 0.15
"""Two that begin at once listen for times that differ by up to so much, drawn at random [s]."""

SETTLE_S: Final = 0.3
"""Listened on after the own heartbeat began [s]."""

_SDO_REQUEST, _SDO_ANSWER = 0x600, 0x580
_RPDOS: Final = {0x200: "RPDO 1", 0x300: "RPDO 2", 0x400: "RPDO 3", 0x500: "RPDO 4"}
"""Identifiers of CiA 301's predefined connection set, without the node id."""

_ASK_STATUSWORD: Final = bytes((0x40, 0x41, 0x60, 0, 0, 0, 0, 0))
_EXPEDITED: Final = (b"\x4b", b"\x43", b"\x42")
"""Answers with the value in them, of two bytes or more; an abort has another first byte (CiA 301, 7.2.4.3.6)."""

_MULTIPLEXER: Final = slice(1, 4)


class _HostListener:
    """What a bus carries of another host, from now on."""

    def __init__(self, link: CanLink, rig: Rig) -> None:
        self.heard: str | None = None
        self._seen = threading.Event()
        hosts = {rig.host_node_id, rig.monitor_node_id}
        names = {SYNC_COB_ID: "SYNC", NMT_COB_ID: "an NMT command"}
        names |= {HEARTBEAT_COB_ID + node_id: f"the heartbeat of a host, node {node_id}" for node_id in hosts}
        for name, node_id in _nodes(rig).items():
            names[_SDO_REQUEST + node_id] = f"an SDO request to {name}"
            names |= {cob_id + node_id: f"{what} for {name}" for cob_id, what in _RPDOS.items()}
        for cob_id, what in names.items():
            link.subscribe(cob_id, partial(self._hear, f"{what} (frame 0x{cob_id:03X}"))

    def _hear(self, what: str, data: bytes, t_ns: int) -> None:
        if self.heard is None:
            self.heard = f"{what} [{data.hex(' ')}])"
            self._seen.set()

    def wait(self, timeout_s: float) -> None:
        """Listen for so long, or until something is heard."""
        self._seen.wait(timeout_s)


def listening_s(rig: Rig) -> float:
    """How long this rig's bus is listened to before the first command [s]."""
    tables = (rig.inverters.m1, rig.inverters.m2)
    heartbeats_s = [each / 1000.0 for table in tables for each in (table.heartbeat_ms, table.host_timeout_ms)]
    return max(LISTEN_S, 10.0 * rig.period_s, *heartbeats_s)


def require_sole_host(link: CanLink, rig: Rig, heartbeat_s: float | None) -> None:
    """See that nobody else drives, before the first command; on a bus inside this process there is nobody else."""
    alone = rig.can.url.startswith(IN_PROCESS)
    ear = _HostListener(link, rig)
    if not alone:
        ear.wait(0.0 if rig.takes_over else listening_s(rig) + random.uniform(0.0, APART_S))
        link.raise_if_failed()
        _require_silence(ear, rig)
    _require_disabled(link, rig)
    if heartbeat_s is None or alone:
        return
    _require_silence(ear, rig)
    link.produce_heartbeat(heartbeat_s, rig.host_node_id)
    ear.wait(SETTLE_S)
    if ear.heard is not None and not rig.takes_over:
        link.stop_heartbeat()
    _require_silence(ear, rig)


def _require_disabled(link: CanLink, rig: Rig) -> None:
    timeout_s = max(rig.inverters.m1.sdo_timeout_s, rig.inverters.m2.sdo_timeout_s)
    for name, node_id in _nodes(rig).items():
        state = _state_of(link, node_id, timeout_s)
        if state in TORQUE_STATES:
            raise ForeignController(
                f"inverter {name} (node {node_id}): power state is {state.value} before this program's first command, "
                "expected a drive that is disabled. Another host drives it, or one that died has left it so. No "
                "command was sent: end that host, or disable the drive at its own control or by its mains."
            )


def _nodes(rig: Rig) -> dict[str, int]:
    return {"m1": rig.inverters.m1.node_id, "m2": rig.inverters.m2.node_id}


def _require_silence(ear: _HostListener, rig: Rig) -> None:
    if ear.heard is None or rig.takes_over:
        return
    raise ForeignController(
        f"CAN bus {rig.can.url}: {ear.heard} came from somebody else, expected {listening_s(rig):g} s without another "
        "host before the first command. No command was sent: end the other host, or unplug it. Where it has to stay "
        "and its drives are disabled: --take-over."
    )


def _state_of(link: CanLink, node_id: int, timeout_s: float) -> PowerState | None:
    """Read a drive's power state; None where it does not say, which whoever configures it will name."""
    answered, words = threading.Event(), list[int]()

    def take(data: bytes, t_ns: int) -> None:
        if data[:1] in _EXPEDITED and data[_MULTIPLEXER] == _ASK_STATUSWORD[_MULTIPLEXER]:
            words.append(int.from_bytes(data[4:6], "little"))
            answered.set()

    link.subscribe(_SDO_ANSWER + node_id, take)
    link.send(_SDO_REQUEST + node_id, _ASK_STATUSWORD)
    answered.wait(timeout_s)
    try:
        return state_of(words[0]) if words else None
    except ProtocolViolation:
        return None
