"""SDO against a scripted node that answers wrongly, late, or not at all."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest

from drivers.canopen.can_link import CanLink
from drivers.canopen.sdo import SdoChannel, SdoNode
from drivers.datasheet.file import EdsFile
from drivers.errors import CommandRefused, ConfigMismatch, DeviceTimeout, ProtocolViolation
from tests.drivers.can_bench import new_channel

NODE_ID = 5


@dataclass
class ScriptedNode:
    """Answers each SDO request with the frames of its script."""

    link: CanLink
    answers: Callable[[bytes], list[bytes]] = lambda request: []
    requests: list[bytes] = field(default_factory=list)

    def on_request(self, data: bytes, t_ns: int) -> None:
        self.requests.append(data)
        for answer in self.answers(data):
            self.link.send(0x580 + NODE_ID, answer)


@dataclass
class Pair:
    link: CanLink
    sdo: SdoChannel
    node: ScriptedNode


@pytest.fixture
def pair() -> Iterator[Pair]:
    channel = new_channel()
    with CanLink.open(f"virtual:{channel}") as device, CanLink.open(f"virtual:{channel}") as link:
        node = ScriptedNode(device)
        device.subscribe(0x600 + NODE_ID, node.on_request)
        eds = EdsFile(None, NODE_ID)
        remote = SdoNode(NODE_ID, eds.dictionary)
        link.network.add_node(remote)
        yield Pair(link, SdoChannel(remote, eds, "node 5", timeout_s=0.05), node)


def uploaded(request: bytes, value: bytes) -> bytes:
    """Expedited upload answer to a request, CiA 301 7.2.4.3.6."""
    return bytes([0x43 | (4 - len(value)) << 2]) + request[1:4] + value.ljust(4, b"\0")


def acknowledged(request: bytes) -> bytes:
    """Download answer to a request."""
    return b"\x60" + request[1:4] + bytes(4)


def test_value_is_read_with_the_type_of_the_eds(pair: Pair) -> None:
    pair.node.answers = lambda request: [uploaded(request, b"\xfe\xff")]
    assert pair.sdo.upload(0x6077) == -2
    assert pair.node.requests == [bytes.fromhex("40 77 60 00 00 00 00 00")]


def test_value_is_written_with_the_type_of_the_eds(pair: Pair) -> None:
    pair.node.answers = lambda request: [acknowledged(request)]
    pair.sdo.download(0x6071, 0, -2)
    assert pair.node.requests == [bytes.fromhex("2b 71 60 00 fe ff 00 00")]


def test_value_that_does_not_fit_is_not_sent(pair: Pair) -> None:
    with pytest.raises(CommandRefused, match=r"object 0x6071:00: 32768 does not fit INTEGER16"):
        pair.sdo.download(0x6071, 0, 32768)
    assert pair.node.requests == []


@pytest.mark.parametrize("write", [False, True])
def test_silence_is_a_timeout(pair: Pair, write: bool) -> None:
    with pytest.raises(DeviceTimeout, match=r"node 5: no SDO answer for object 0x6071:00 within 0\.05 s"):
        pair.sdo.download(0x6071, 0, 0) if write else pair.sdo.upload(0x6071)


@pytest.mark.parametrize("write", [False, True])
def test_abort_is_a_mismatch_with_its_reason(pair: Pair, write: bool) -> None:
    pair.node.answers = lambda request: [b"\x80" + request[1:4] + bytes.fromhex("00 00 02 06")]
    with pytest.raises(ConfigMismatch, match=r"object 0x6071:00 refused .*0x06020000, Object does not exist"):
        pair.sdo.download(0x6071, 0, 0) if write else pair.sdo.upload(0x6071)


def test_answer_shorter_than_the_object_is_a_violation(pair: Pair) -> None:
    pair.node.answers = lambda request: [uploaded(request, b"\x01")]
    with pytest.raises(ProtocolViolation, match=r"came with 1 bytes, expected 2 \(INTEGER16"):
        pair.sdo.upload(0x6077)


def test_late_answers_to_other_requests_are_left_alone(pair: Pair) -> None:
    """The library alone would take the acknowledgement of 0x60B2 for that of 0x6040."""
    late = acknowledged(bytes.fromhex("2b b2 60 00"))
    late_abort = bytes.fromhex("80 b2 60 00 00 00 02 06")
    pair.node.answers = lambda request: [late, late_abort]
    with pytest.raises(DeviceTimeout, match="0x6040:00"):
        pair.sdo.download(0x6040, 0, 0)
    pair.node.answers = lambda request: [
        late,
        uploaded(bytes.fromhex("40 77 60 00"), b"\1\1"),
        uploaded(request, bytes(4)) if request[0] == 0x40 else acknowledged(request),
    ]
    pair.sdo.download(0x6040, 0, 0)


@dataclass
class LateOnce:
    """Keeps its answer to the first of the requests for one object, and lets it go later.

    ``release`` says when: ``before`` its answer to the probe, as a node that works its requests off in their order;
    ``behind`` it, as a gateway with several queues; ``never``, for a frame that was lost.
    """

    index: bytes
    release: str
    values: list[bytes]
    kept: list[bytes] = field(default_factory=list)
    first: bool = True

    def __call__(self, request: bytes) -> list[bytes]:
        if request[0] == 0x80:
            return []
        if request[1:3] != self.index:
            answer, kept = uploaded(request, bytes(4)), self.kept
            self.kept = []
            return {"before": [*kept, answer], "behind": [answer, *kept], "never": [answer]}[self.release]
        answer = uploaded(request, self.values.pop(0)) if request[0] == 0x40 else acknowledged(request)
        if not self.first:
            return [answer]
        self.first, self.kept = False, [answer]
        return []


@pytest.mark.parametrize("release", ["before", "behind", "never"])
def test_late_answer_is_never_taken_for_that_of_the_same_object_asked_for_again(pair: Pair, release: str) -> None:
    pair.node.answers = LateOnce(b"\x41\x60", release, [b"\x27\x00", b"\x08\x00", b"\x40\x00"])
    with pytest.raises(DeviceTimeout):
        pair.sdo.upload(0x6041)
    assert pair.sdo.upload(0x6041) == 0x0008
    assert pair.sdo.upload(0x6041) == 0x0040


@pytest.mark.parametrize("release", ["before", "behind", "never"])
def test_late_acknowledgement_does_not_confirm_the_same_object_written_again(pair: Pair, release: str) -> None:
    node = LateOnce(b"\x40\x60", release, [])
    pair.node.answers = node
    with pytest.raises(DeviceTimeout):
        pair.sdo.download(0x6040, 0, 6)
    pair.node.answers = lambda request: node(request) if request[1:3] != b"\x40\x60" else []
    with pytest.raises(DeviceTimeout):
        pair.sdo.download(0x6040, 0, 7)


def test_request_to_a_node_that_says_nothing_goes_out_all_the_same(pair: Pair) -> None:
    """It may be the one that takes the torque away: a node that can't be heard may hear."""
    for value in (1, 2, 3, 4, 5, 6):
        with pytest.raises(DeviceTimeout, match="0x6040:00"):
            pair.sdo.download(0x6040, 0, value)
    written = [request[4] for request in pair.node.requests if request[:3] == b"\x2b\x40\x60"]
    assert written == [1, 2, 3, 4, 5, 6]


def test_answer_of_another_length_is_a_violation_at_the_next_sync(pair: Pair) -> None:
    pair.node.answers = lambda request: [b"\x43\x77\x60"]
    with pytest.raises(DeviceTimeout):
        pair.sdo.upload(0x6077)
    with pytest.raises(ProtocolViolation, match="SDO answer 0x585 of 3 bytes, expected 8"):
        pair.link.sync()


def test_write_that_does_not_hold_is_a_mismatch(pair: Pair) -> None:
    def forget(request: bytes) -> list[bytes]:
        return [uploaded(request, b"\0")] if request[0] == 0x40 else [acknowledged(request)]

    pair.node.answers = forget
    with pytest.raises(ConfigMismatch, match=r"object 0x6060:00 reads 0 \(0x0\) after writing 10 \(0xA\)"):
        pair.sdo.download_confirmed(0x6060, 0, 10)


def in_segments(text: bytes) -> Callable[[bytes], list[bytes]]:
    """A node that gives an object in segments of 7 bytes with a toggle bit, CiA 301 7.2.4.3.6 and 7.2.4.3.7."""
    rest = bytearray(text)

    def answer(request: bytes) -> list[bytes]:
        if request[0] >> 5 == 2:
            return [b"\x41" + request[1:4] + len(text).to_bytes(4, "little")]
        part = bytes(rest[:7])
        del rest[:7]
        command = request[0] & 0x10 | (7 - len(part)) << 1 | (not rest)
        return [bytes([command]) + part.ljust(7, b"\0")]

    return answer


@pytest.mark.parametrize("text", ["Traction inverter", "14 characters.", "8 signs."])
def test_text_comes_in_segments(pair: Pair, text: str) -> None:
    pair.node.answers = in_segments(text.encode())
    assert pair.sdo._client.upload(0x1008, 0) == text.encode()
    assert len(pair.node.requests) == 1 + -(-len(text) // 7)
