"""Emergency messages: frame to cause. No bus, no clock.

The texts are those of CiA 301 (error classes) and CiA 402 (drive error codes); the longest match counts.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.errors import ProtocolViolation

EMCY_COB_ID = 0x080
"""Plus the node id."""

_FRAME = struct.Struct("<HB5s")

_CAUSES: dict[str, str] = {
    "0": "error reset or no error",
    "1": "generic error",
    "2": "current",
    "22": "internal current",
    "23": "current on the motor side",
    "231": "continuous over-current",
    "2310": "continuous over-current, motor side",
    "2320": "short circuit or earth leakage, motor side",
    "3": "voltage",
    "31": "mains voltage",
    "3210": "DC link over-voltage",
    "3220": "DC link under-voltage",
    "4": "temperature",
    "4210": "excess temperature of the device",
    "4310": "excess temperature of the drive",
    "5": "device hardware",
    "5441": "contactor",
    "6": "device software",
    "7": "additional modules",
    "7120": "motor blocked or motor fault",
    "7300": "sensor",
    "7303": "resolver 1 fault",
    "8": "monitoring",
    "8110": "CAN overrun, objects lost",
    "8120": "CAN in error passive mode",
    "8130": "life guard or heartbeat error",
    "8140": "recovered from bus-off",
    "82": "protocol error",
    "8210": "PDO not processed: wrong length",
    "8220": "PDO longer than its mapping",
    "8250": "RPDO timeout: the host's command did not come in time",
    "8311": "excess torque",
    "8331": "torque fault",
    "8400": "speed controller: velocity outside its limits",
    "9": "external error",
    "F": "additional functions",
    "FF": "device specific",
}


def cause_of(code: int) -> str:
    """Cause of an EMCY error code or of object 0x603F, in words."""
    digits = f"{code:04X}"
    for length in range(4, 0, -1):
        if digits[:length] in _CAUSES:
            return _CAUSES[digits[:length]]
    return "a code outside CiA 301 and CiA 402"


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
    """Unpack an EMCY frame.

    Raises
    ------
    ProtocolViolation
        If it has not the 8 bytes CiA 301 gives it.
    """
    if len(data) != _FRAME.size:
        raise ProtocolViolation(
            f"EMCY frame of {len(data)} bytes ({data.hex(' ')}), expected {_FRAME.size}. "
            "Check the device's firmware version."
        )
    return Emergency(*_FRAME.unpack(data))
