"""TPDOs as they arrive: all that were asked for are waited for, and each kind is counted."""

import threading

from drivers.canopen.pdo_map import MappedObject, PdoCodec, PdoLayout
from drivers.inverter.cia402 import STATUSWORD_STATE_BITS, PowerState
from drivers.inverter.feedback import ChannelReceiver, FeedbackReceiver
from drivers.scaling import IntegerType, TorqueScale, VelocityScale

TYPES = {(0x6041, 0): IntegerType.UNSIGNED16, (0x6077, 0): IntegerType.INTEGER16, (0x606C, 0): IntegerType.INTEGER32}


def codec(number: int, *indices: int) -> PdoCodec:
    objects = tuple(MappedObject(index, 0, 8 * TYPES[index, 0].size_bytes) for index in indices)
    return PdoCodec(PdoLayout(0x1800 + number, 0x1A00 + number, 0x181 + number, True, 1, objects), TYPES, "a drive")


def test_further_objects_are_waited_for_until_all_have_come() -> None:
    receiver = ChannelReceiver([codec(0, 0x6077), codec(1, 0x606C)], [(0x6077, 0), (0x606C, 0)])
    receiver.start_anew()
    receiver.on_frame(0, b"\x05\x00", 10)
    assert receiver.await_after(0, 0.01) == (5, None)
    late = threading.Timer(0.05, receiver.on_frame, (1, b"\x07\x00\x00\x00", 11))
    late.start()
    assert receiver.await_after(0, 30.0) == (5, 7)
    late.join()
    assert receiver.await_after(10, 0.01) == (None, 7)


def test_each_kind_of_tpdo_is_counted() -> None:
    status = STATUSWORD_STATE_BITS[PowerState.OPERATION_ENABLED].to_bytes(2, "little")
    receiver = FeedbackReceiver([codec(0, 0x6041, 0x6077), codec(1, 0x606C)], TorqueScale(600.0), VelocityScale(0.1))
    receiver.start_anew()
    receiver.on_frame(0, status + b"\x05\x00", 1)
    assert receiver.await_after(0, 0.01) is None
    assert receiver.messages() == (0, 1)
    receiver.on_frame(1, b"\x07\x00\x00\x00", 2)
    seen = receiver.await_after(0, 0.01)
    assert seen is not None
    assert (seen.torque_nm, seen.t_ns) == (3.0, 1)
    receiver.on_frame(1, b"\x07\x00\x00\x00", 3)
    assert receiver.messages() == (0, 2)
    receiver.start_anew()
    assert receiver.messages() == (0, 0)
