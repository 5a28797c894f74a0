"""Emergency frames: decoded, described, refused when malformed."""

import pytest

from drivers.canopen.emcy import Emergency, cause_of, decode
from drivers.errors import ProtocolViolation


def test_frame_survives_encoding_and_decoding() -> None:
    emergency = Emergency(0x2310, 0x03, b"\x01\x02\x03\x04\x05")
    assert emergency.encode() == bytes.fromhex("10 23 03 01 02 03 04 05")
    assert decode(emergency.encode()) == emergency


@pytest.mark.parametrize(
    ("code", "cause"),
    [
        (0x2310, "continuous over-current, motor side"),
        (0x2311, "continuous over-current, motor side, no. 1"),
        (0x231A, "continuous over-current, motor side"),
        (0x23AA, "current, device output side"),
        (0x5201, "control hardware"),
        (0x7121, "motor blocked"),
        (0x7180, "power stage"),
        (0x7305, "incremental sensor 1 fault"),
        (0x7320, "position sensor"),
        (0x73AA, "sensor"),
        (0x7ABC, "additional modules"),
        (0x8480, "velocity controller"),
        (0x8611, "following error"),
        (0x8612, "reference limit"),
        (0x2FFF, "current"),
        (0x8130, "life guard or heartbeat error"),
        (0x4310, "excess temperature of the drive"),
        (0xFF01, "device specific: see the maker's manual"),
        (0xB000, "a code outside CiA 301 and CiA 402"),
    ],
)
def test_the_longest_known_code_names_the_cause(code: int, cause: str) -> None:
    assert cause_of(code) == cause


def test_only_code_00xx_is_a_reset() -> None:
    assert Emergency(0x0000, 0, bytes(5)).is_reset
    assert not Emergency(0x1000, 0, bytes(5)).is_reset


@pytest.mark.parametrize("length", [0, 7, 9])
def test_frame_of_another_length_is_refused(length: int) -> None:
    with pytest.raises(ProtocolViolation, match=f"EMCY frame of {length} bytes.*expected 8"):
        decode(bytes(length))
