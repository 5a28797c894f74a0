"""Emergency messages: frame to cause, and error codes in words. No bus, no clock.

The codes are in ``emcy.toml``; they are also those of object 0x603F. A code of two or three digits with zeros behind it
names all that begin so, and the one with the most digits counts: 0x7305 is the first incremental sensor, 0x73AA some
sensor, 0x7ABC an additional module.
"""

from __future__ import annotations

import struct
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from drivers.errors import ProtocolViolation

CAUSES: Final[Mapping[int, str]] = MappingProxyType(
    {
        int(code, 16): text
        for code, text in tomllib.loads(Path(__file__).with_name("emcy.toml").read_text("utf-8")).items()
    }
)
"""Text by code."""

_MASKS: Final = (0xFFFF, 0xFFF0, 0xFF00, 0xF000)  # from one code to its whole range

EMCY_COB_ID = 0x080  # plus the node id

RPDO_TIMEOUT: Final = 0x8250  # no command within the deadline: also what a drive says of a host that has ended its run

_FRAME = struct.Struct("<HB5s")


def cause_of(code: int) -> str:
    """Cause of an EMCY error code or of object 0x603F, in words."""
    known = (CAUSES[code & mask] for mask in _MASKS if code & mask in CAUSES)
    return next(known, "a code outside CiA 301 and CiA 402")


@dataclass(frozen=True, slots=True)
class Emergency:
    """One EMCY message."""

    code: int  # error code, as in object 0x603F
    register: int  # error register, object 0x1001
    vendor_data: bytes  # five bytes of the manufacturer

    @property
    def is_reset(self) -> bool:
        """True for the message that ends an emergency (code 0x00xx)."""
        return self.code & 0xFF00 == 0

    def __str__(self) -> str:
        vendor = f", manufacturer data {self.vendor_data.hex(' ')}" if any(self.vendor_data) else ""
        return f"EMCY 0x{self.code:04X} {cause_of(self.code)} (error register 0x{self.register:02X}{vendor})"

    def encode(self) -> bytes:
        """Pack into the 8 bytes of the frame."""
        return _FRAME.pack(self.code, self.register, self.vendor_data)


def decode(data: bytes) -> Emergency:
    """Decode the 8 bytes of an EMCY frame (CiA 301); ProtocolViolation if there are not 8."""
    if len(data) != _FRAME.size:
        raise ProtocolViolation(
            f"EMCY frame of {len(data)} bytes ({data.hex(' ')}), expected {_FRAME.size}. "
            "Check the device's firmware version."
        )
    return Emergency(*_FRAME.unpack(data))
