"""Emergency messages: frame to cause. No bus, no clock."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.canopen.emcy_codes import cause_of
from drivers.errors import ProtocolViolation

EMCY_COB_ID = 0x080
"""Plus the node id."""

_FRAME = struct.Struct("<HB5s")


@dataclass(frozen=True, slots=True)
class Emergency:
    """One EMCY message.

    Attributes
    ----------
    code
        Error code, as in object 0x603F.
    register
        Error register, object 0x1001.
    vendor_data
        Five bytes of the manufacturer.
    """

    code: int
    register: int
    vendor_data: bytes

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
    """Unpack an EMCY frame."""
    if len(data) != _FRAME.size:
        raise ProtocolViolation(
            f"EMCY frame of {len(data)} bytes ({data.hex(' ')}), expected {_FRAME.size}. "
            "Check the device's firmware version."
        )
    return Emergency(*_FRAME.unpack(data))
