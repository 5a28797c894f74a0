"""The COB-IDs of a bus: each is used once, by one of those on it, from before a drive is set up on.

On it are both drives, this program, and the PLC's gateway where the rig file names what that sends. A DCF may give a
drive the COB-IDs that the other has until it is set up too: for that time both send, or listen, under one identifier,
and what one of them says looks like another controller's.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from drivers.canopen.can_link import SYNC_COB_ID
from drivers.canopen.emcy import EMCY_COB_ID
from drivers.canopen.heartbeat import HEARTBEAT_COB_ID, NMT_COB_ID
from drivers.canopen.pdo_map import COB_ID_INVALID
from drivers.capability.carrier import TPDO
from drivers.inverter.check import Difference
from drivers.inverter.inspection import InspectedInverter

COB_ID_BITS: Final = 0x7FF

_OF_A_NODE: Final = {EMCY_COB_ID: "EMCY", 0x580: "SDO answer", 0x600: "SDO request", HEARTBEAT_COB_ID: "heartbeat"}
"""Of the predefined connection set (CiA 301), without the node id."""

Roles = dict[int, str]


def shared_cob_ids(
    one: InspectedInverter, other: InspectedInverter, gateway: Collection[int] = ()
) -> Iterator[Difference]:
    """List what two of those on the bus use, or would use while a drive is not set up; reads objects, writes none.

    ``gateway`` has what the PLC's gateway sends.
    """
    present = [_present(each) for each in (one, other)]
    node_id = HEARTBEAT_COB_ID + one.settings.host_node_id
    alien = {
        "this program": {NMT_COB_ID: "NMT commands", SYNC_COB_ID: "SYNC", node_id: "heartbeat"},
        "the PLC's gateway": dict.fromkeys(gateway, "messages"),
    }
    for mine, others, had in ((one, other, present[1]), (other, one, present[0])):
        on_bus = {others.settings.name: had | _used(others)} | alien
        yield from _shared(mine.settings.where, _used(mine), on_bus, "its data sheet")
    yield from _shared("plc", alien.pop("the PLC's gateway"), alien, "plc.cob_ids of the rig file")


def _shared(where: str, mine: Roles, others: dict[str, Roles], source: str) -> Iterator[Difference]:
    for cob_id, role in mine.items():
        for name, theirs in others.items():
            if cob_id in theirs:
                yield Difference(
                    where,
                    f"COB-ID of its {role}",
                    f"one that {name} does not use",
                    f"0x{cob_id:03X}, which {name} uses for its {theirs[cob_id]}",
                    source,
                )


def _used(inverter: InspectedInverter) -> Roles:
    """COB-IDs in a run, and what for."""
    roles = {cob_id + inverter.settings.node_id: role for cob_id, role in _OF_A_NODE.items()}
    return roles | {layout.cob_id: _role(layout.communication_index) for layout in inverter.layouts}


def _present(inverter: InspectedInverter) -> Roles:
    """Read the COB-IDs that the device has now, of the PDOs that a run uses."""
    present = {layout.communication_index: inverter.read_cob_id(layout) for layout in inverter.layouts}
    return {value & COB_ID_BITS: _role(index) for index, value in present.items() if not value & COB_ID_INVALID}


def _role(communication_index: int) -> str:
    return f"{'TPDO' if communication_index >= TPDO.communication else 'RPDO'} 0x{communication_index:04X}"
