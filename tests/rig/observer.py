"""A third node on the bus that asks the drives themselves, by plain SDO uploads (CiA 301, 7.2.4.3)."""

import queue

from drivers.canopen.can_link import CanLink
from drivers.inverter.cia402 import PowerState, state_of

UPLOAD = 0x40
DISARMED = (PowerState.SWITCH_ON_DISABLED, PowerState.READY_TO_SWITCH_ON)


def read_object(bus_url: str, node_id: int, index: int, subindex: int = 0) -> int:
    """Read one unsigned object of at most 4 bytes."""
    answers: queue.Queue[bytes] = queue.Queue()
    with CanLink.open(bus_url) as link:
        link.subscribe(0x580 + node_id, lambda data, t_ns: answers.put(data))
        link.send(0x600 + node_id, bytes((UPLOAD, index & 0xFF, index >> 8, subindex, 0, 0, 0, 0)))
        answer = answers.get(timeout=60.0)
    assert answer[0] & 0xE3 == 0x43, f"expected an expedited upload, got [{answer.hex(' ')}]"
    return int.from_bytes(answer[4 : 8 - ((answer[0] >> 2) & 3)], "little")


def power_state(bus_url: str, node_id: int) -> PowerState:
    """State a drive reports of itself."""
    return state_of(read_object(bus_url, node_id, 0x6041))


def assert_disarmed(bus_url: str, *node_ids: int) -> None:
    """The drives are out of operation, and both torque objects stand at zero."""
    for node_id in node_ids:
        assert power_state(bus_url, node_id) in DISARMED
        assert read_object(bus_url, node_id, 0x6071) == 0
        assert read_object(bus_url, node_id, 0x60B2) == 0
