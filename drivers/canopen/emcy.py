"""Emergency messages: frame to cause, and error codes in words. No bus, no clock.

The codes are the ranges of CiA 301 (table "Emergency error codes") and those of CiA 402-2 (IEC 61800-7-201), annex
"Error codes", for drives; they are also those of object 0x603F. A code of two or three digits with zeros behind it
names all that begin so, and the one with the most digits counts: 0x7305 is the first incremental sensor, 0x73AA some
sensor, 0x7ABC an additional module.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from drivers.errors import ProtocolViolation

_CIA_301: Final = {
    0x0000: "error reset or no error",
    0x1000: "generic error",
    0x2000: "current",
    0x2100: "current, device input side",
    0x2200: "current inside the device",
    0x2300: "current, device output side",
    0x3000: "voltage",
    0x3100: "mains voltage",
    0x3200: "voltage inside the device",
    0x3300: "output voltage",
    0x4000: "temperature",
    0x4100: "ambient temperature",
    0x4200: "device temperature",
    0x5000: "device hardware",
    0x6000: "device software",
    0x6100: "internal software",
    0x6200: "user software",
    0x6300: "data set",
    0x7000: "additional modules",
    0x8000: "monitoring",
    0x8100: "communication",
    0x8110: "CAN overrun, objects lost",
    0x8120: "CAN in error passive mode",
    0x8130: "life guard or heartbeat error",
    0x8140: "recovered from bus-off",
    0x8150: "CAN identifier collision",
    0x8200: "protocol error",
    0x8210: "PDO not processed: wrong length",
    0x8220: "PDO longer than its mapping",
    0x8230: "DAM MPDO not processed: no such object",
    0x8240: "SYNC of unexpected length: a SYNC counter is expected, or is not",
    0x8250: "RPDO timeout: the host's command did not come in time",
    0x9000: "external error",
    0xF000: "additional functions",
    0xFF00: "device specific: see the maker's manual",
}

_CURRENT: Final = {
    0x2110: "short circuit or earth leakage, input side",
    0x2120: "earth leakage, input side",
    0x2121: "earth leakage, phase L1",
    0x2122: "earth leakage, phase L2",
    0x2123: "earth leakage, phase L3",
    0x2130: "short circuit, input side",
    0x2131: "short circuit, phases L1 and L2",
    0x2132: "short circuit, phases L2 and L3",
    0x2133: "short circuit, phases L3 and L1",
    0x2211: "current inside the device, no. 1",
    0x2212: "current inside the device, no. 2",
    0x2213: "over-current in the ramp function",
    0x2214: "over-current in the sequence",
    0x2220: "continuous over-current inside the device",
    0x2221: "continuous over-current inside the device, no. 1",
    0x2222: "continuous over-current inside the device, no. 2",
    0x2230: "short circuit or earth leakage inside the device",
    0x2240: "earth leakage inside the device",
    0x2250: "short circuit inside the device",
    0x2310: "continuous over-current, motor side",
    0x2311: "continuous over-current, motor side, no. 1",
    0x2312: "continuous over-current, motor side, no. 2",
    0x2320: "short circuit or earth leakage, motor side",
    0x2330: "earth leakage, motor side",
    0x2331: "earth leakage, phase U",
    0x2332: "earth leakage, phase V",
    0x2333: "earth leakage, phase W",
    0x2340: "short circuit, motor side",
    0x2341: "short circuit, phases U and V",
    0x2342: "short circuit, phases V and W",
    0x2343: "short circuit, phases W and U",
}

_VOLTAGE: Final = {
    0x3110: "mains over-voltage",
    0x3111: "mains over-voltage, phase L1",
    0x3112: "mains over-voltage, phase L2",
    0x3113: "mains over-voltage, phase L3",
    0x3120: "mains under-voltage",
    0x3121: "mains under-voltage, phase L1",
    0x3122: "mains under-voltage, phase L2",
    0x3123: "mains under-voltage, phase L3",
    0x3130: "mains phase failure",
    0x3131: "mains phase failure, L1",
    0x3132: "mains phase failure, L2",
    0x3133: "mains phase failure, L3",
    0x3134: "mains phase sequence",
    0x3140: "mains frequency",
    0x3141: "mains frequency too high",
    0x3142: "mains frequency too low",
    0x3200: "DC link voltage",
    0x3210: "DC link over-voltage",
    0x3211: "DC link over-voltage, no. 1",
    0x3212: "DC link over-voltage, no. 2",
    0x3220: "DC link under-voltage",
    0x3221: "DC link under-voltage, no. 1",
    0x3222: "DC link under-voltage, no. 2",
    0x3230: "load error",
    0x3310: "output over-voltage",
    0x3311: "output over-voltage, phase U",
    0x3312: "output over-voltage, phase V",
    0x3313: "output over-voltage, phase W",
    0x3320: "armature circuit",
    0x3321: "armature circuit interrupted",
    0x3330: "field circuit",
    0x3331: "field circuit interrupted",
}

_TEMPERATURE: Final = {
    0x4110: "ambient temperature too high",
    0x4120: "ambient temperature too low",
    0x4130: "temperature of the supply air",
    0x4140: "temperature of the air outlet",
    0x4210: "excess temperature of the device",
    0x4220: "device temperature too low",
    0x4300: "temperature of the drive",
    0x4310: "excess temperature of the drive",
    0x4320: "temperature of the drive too low",
    0x4400: "temperature of the supply",
    0x4410: "excess temperature of the supply",
    0x4420: "temperature of the supply too low",
}

_DEVICE: Final = {
    0x5100: "supply of the device hardware",
    0x5110: "low voltage supply",
    0x5111: "low voltage supply U1, +/-15 V",
    0x5112: "low voltage supply U2, +24 V",
    0x5113: "low voltage supply U3, +5 V",
    0x5120: "supply of the intermediate circuit",
    0x5200: "control hardware",
    0x5210: "measurement circuit of the control",
    0x5220: "computing circuit of the control",
    0x5300: "operating unit",
    0x5400: "power section",
    0x5410: "output stages",
    0x5420: "chopper",
    0x5430: "input stages",
    0x5440: "contactor",
    0x5450: "fuse",
    0x5451: "fuse S1, L1",
    0x5452: "fuse S2, L2",
    0x5453: "fuse S3, L3",
    0x5500: "data storage of the device hardware",
    0x5510: "working memory (RAM)",
    0x5520: "program memory (EPROM)",
    0x5530: "non-volatile memory (EEPROM)",
    0x6010: "software reset (watchdog)",
    0x6310: "loss of parameters",
    0x6320: "parameter error",
}

_MODULES: Final = {
    0x7100: "power stage",
    0x7110: "brake chopper",
    0x7111: "brake chopper failed",
    0x7112: "over-current in the brake chopper",
    0x7113: "protective circuit of the brake chopper",
    0x7120: "motor",
    0x7121: "motor blocked",
    0x7122: "motor error or commutation fault",
    0x7123: "motor tilted",
    0x7200: "measurement circuit",
    0x7300: "sensor",
    0x7301: "tachometer fault",
    0x7302: "tachometer of the wrong polarity",
    0x7303: "resolver 1 fault",
    0x7304: "resolver 2 fault",
    0x7305: "incremental sensor 1 fault",
    0x7306: "incremental sensor 2 fault",
    0x7307: "incremental sensor 3 fault",
    0x7310: "speed sensor",
    0x7320: "position sensor",
    0x7400: "computing circuit",
    0x7500: "communication module",
    0x7510: "serial interface 1",
    0x7520: "serial interface 2",
    0x7600: "data storage module",
}

_MONITORING: Final = {
    0x8300: "torque control",
    0x8311: "excess torque",
    0x8312: "difficult start-up",
    0x8313: "standstill torque",
    0x8321: "insufficient torque",
    0x8331: "torque fault",
    0x8400: "velocity controller",
    0x8500: "position controller",
    0x8600: "positioning controller",
    0x8611: "following error",
    0x8612: "reference limit",
    0x8700: "SYNC controller",
    0x8800: "winding controller",
    0x8900: "process data monitoring",
    0x8A00: "control monitoring",
    0xF001: "deceleration",
    0xF002: "sub-synchronous run",
    0xF003: "stroke operation",
    0xF004: "control function",
}

CAUSES: Final[Mapping[int, str]] = MappingProxyType(
    {**_CIA_301, **_CURRENT, **_VOLTAGE, **_TEMPERATURE, **_DEVICE, **_MODULES, **_MONITORING}
)
"""Text by code; where both standards have one, CiA 402's."""

_MASKS: Final = (0xFFFF, 0xFFF0, 0xFF00, 0xF000)
"""From one code to its whole range."""


def cause_of(code: int) -> str:
    """Cause of an EMCY error code or of object 0x603F, in words."""
    known = (code & mask for mask in _MASKS if code & mask in CAUSES)
    best = next(known, None)
    return "a code outside CiA 301 and CiA 402" if best is None else CAUSES[best]


EMCY_COB_ID = 0x080
"""Plus the node id."""

_FRAME = struct.Struct("<HB5s")


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
    """Unpack an EMCY frame."""
    if len(data) != _FRAME.size:
        raise ProtocolViolation(
            f"EMCY frame of {len(data)} bytes ({data.hex(' ')}), expected {_FRAME.size}. "
            "Check the device's firmware version."
        )
    return Emergency(*_FRAME.unpack(data))
