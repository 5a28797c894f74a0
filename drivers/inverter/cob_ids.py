"""The COB-IDs of two drives on one bus: each is used once, by one of them, from before it is set up on.

A DCF may give a drive the COB-IDs that the other has until it is set up too: for that time both send, or listen, under
one identifier, and what one of them says looks like another controller's.
"""

from __future__ import annotations

from collections.abc import Iterator

from drivers.canopen.emcy import EMCY_COB_ID
from drivers.canopen.pdo_map import COB_ID_INVALID
from drivers.capability.carrier import TPDO
from drivers.inverter.check import Difference
from drivers.inverter.inspection import InspectedInverter

COB_ID_BITS = 0x7FF


def shared_cob_ids(one: InspectedInverter, other: InspectedInverter) -> Iterator[Difference]:
    """List what both drives use, or would use while one of them is not set up; reads objects, writes none."""
    taken = [_present(each) | dict(_used(each)) for each in (one, other)]
    for mine, others, theirs in ((one, other, taken[1]), (other, one, taken[0])):
        for cob_id, role in _used(mine):
            if cob_id in theirs:
                yield Difference(
                    mine.settings.where,
                    f"COB-ID of its {role}",
                    f"one that {others.settings.name} does not use",
                    f"0x{cob_id:03X}, which {others.settings.name} uses for its {theirs[cob_id]}",
                    "its data sheet",
                )


def _used(inverter: InspectedInverter) -> Iterator[tuple[int, str]]:
    """List COB-IDs in a run, and what for."""
    for layout in inverter.layouts:
        yield layout.cob_id, _role(layout.communication_index)
    yield EMCY_COB_ID + inverter.settings.node_id, "EMCY"


def _present(inverter: InspectedInverter) -> dict[int, str]:
    """Read the COB-IDs that the device has now, of the PDOs that a run uses."""
    present = {layout.communication_index: inverter.read_cob_id(layout) for layout in inverter.layouts}
    return {value & COB_ID_BITS: _role(index) for index, value in present.items() if not value & COB_ID_INVALID}


def _role(communication_index: int) -> str:
    return f"{'TPDO' if communication_index >= TPDO.communication else 'RPDO'} 0x{communication_index:04X}"
