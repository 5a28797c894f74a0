"""The virtual bus without a receive thread: order, turns, foreign participants, and its end."""

import threading
from collections import defaultdict

import can
import pytest

from drivers.canopen.inline_bus import InlineBus
from tests.drivers.can_bench import frame, new_channel


@pytest.fixture
def channel() -> str:
    return new_channel()


def test_frame_is_received_before_its_sending_returns(channel: str) -> None:
    got: list[tuple[int, bytes, str]] = []
    with InlineBus(channel) as here, InlineBus(channel) as there:
        there.receive_by(
            lambda message: got.append((message.arbitration_id, bytes(message.data), threading.current_thread().name))
        )
        here.send(frame(0x181, b"\x01\x02"))
        assert got == [(0x181, b"\x01\x02", threading.current_thread().name)]


def test_answer_to_a_frame_arrives_too_and_in_order(channel: str) -> None:
    got: list[int] = []
    with InlineBus(channel) as host, InlineBus(channel) as drive:
        host.receive_by(lambda message: got.append(message.arbitration_id))

        def answer(message: can.Message) -> None:
            drive.send(frame(message.arbitration_id + 1, b""))
            drive.send(frame(message.arbitration_id + 2, b""))

        drive.receive_by(answer)
        host.send(frame(10, b""))
        host.send(frame(20, b""))
        assert got == [11, 12, 21, 22]


def test_frames_of_many_threads_come_one_at_a_time_each_threads_in_order(channel: str) -> None:
    inside, most_inside = 0, 0
    got: defaultdict[int, list[int]] = defaultdict(list)

    def take(message: can.Message) -> None:
        nonlocal inside, most_inside
        inside += 1
        most_inside = max(most_inside, inside)
        got[message.arbitration_id].append(int.from_bytes(message.data, "little"))
        inside -= 1

    def send_all(bus: InlineBus, cob_id: int) -> None:
        for number in range(500):
            bus.send(frame(cob_id, number.to_bytes(2, "little")))

    with InlineBus(channel) as here, InlineBus(channel) as there:
        there.receive_by(take)
        threads = [threading.Thread(target=send_all, args=(here, cob_id)) for cob_id in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert most_inside == 1
    assert dict(got) == {cob_id: list(range(500)) for cob_id in range(4)}


def test_nobody_is_called_after_the_end_and_nothing_can_be_sent(channel: str) -> None:
    got: list[can.Message] = []
    with InlineBus(channel) as here:
        there = InlineBus(channel)
        there.receive_by(got.append)
        there.shutdown()
        here.send(frame(1, b""))
        assert got == []
        with pytest.raises(can.CanOperationError, match="closed bus"):
            there.send(frame(1, b""))
