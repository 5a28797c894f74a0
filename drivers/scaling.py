"""Integers on the bus to SI values and back. No bus, no clock.

::

    torque   [Nm]    = raw * rated / 1000              0x6071, 0x6077, 0x60B2: per mille of rated, 0x6076
    velocity [rad/s] = raw * 10^prefix * unit / time   0x606C, in the unit object 0x60A9 names

A value that does not fit its object raises: it is never wrapped round and never clamped. That matters
because ``canopen`` only warns about a value beyond the EDS limits and sends it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

from drivers.errors import CommandRefused, ConfigMismatch

_RADIANS_OF_UNIT = {0x10: 1.0, 0x41: math.pi / 180.0, 0xB4: 2.0 * math.pi}  # radian, degree, revolution
_SECONDS_OF_UNIT = {0x03: 1.0, 0x47: 60.0}  # second, minute
_PREFIX_LIMIT = 9  # 10^-9 to 10^9


class IntegerType(IntEnum):
    """Integer data types of CiA 301 by their code in the EDS (``DataType``)."""

    INTEGER8 = 0x0002
    INTEGER16 = 0x0003
    INTEGER32 = 0x0004
    UNSIGNED8 = 0x0005
    UNSIGNED16 = 0x0006
    UNSIGNED32 = 0x0007

    @property
    def signed(self) -> bool:
        """Whether it has a sign."""
        return self.name.startswith("INTEGER")

    @property
    def size_bytes(self) -> int:
        """Length on the bus."""
        return _SIZE_BYTES[self]

    @property
    def low(self) -> int:
        """Smallest value."""
        return _RANGE[self][0]

    @property
    def high(self) -> int:
        """Largest value."""
        return _RANGE[self][1]

    def encode(self, value: int, where: str) -> bytes:
        """Pack little-endian."""
        if not self.low <= value <= self.high:
            raise CommandRefused(
                f"{where}: {value} does not fit {self.name}, expected {self.low} to {self.high}. "
                "Nothing was sent; correct the value."
            )
        return value.to_bytes(self.size_bytes, "little", signed=self.signed)

    def decode(self, data: bytes) -> int:
        """Unpack little-endian; the caller has checked the length."""
        return int.from_bytes(data, "little", signed=self.signed)


_SIZE_BYTES = {
    IntegerType.INTEGER8: 1,
    IntegerType.INTEGER16: 2,
    IntegerType.INTEGER32: 4,
    IntegerType.UNSIGNED8: 1,
    IntegerType.UNSIGNED16: 2,
    IntegerType.UNSIGNED32: 4,
}


def _range(kind: IntegerType) -> tuple[int, int]:
    """Least and greatest value of a type."""
    bits = 8 * kind.size_bytes
    return (-(1 << bits - 1), (1 << bits - 1) - 1) if kind.signed else (0, (1 << bits) - 1)


_RANGE = {kind: _range(kind) for kind in IntegerType}


_INT16_RANGE, _INT32_RANGE = _RANGE[IntegerType.INTEGER16], _RANGE[IntegerType.INTEGER32]


def _nearest_count(exact: float, low: int, high: int) -> int | None:
    """Nearest integer, or None if it is not finite or outside the range."""
    if not math.isfinite(exact):
        return None
    count = round(exact)
    return count if low <= count <= high else None


@dataclass(frozen=True, slots=True)
class TorqueScale:
    """Per mille of rated torque (CiA 402 objects 0x6071, 0x6077, 0x60B2) to Nm and back."""

    rated_torque_nm: float  # motor rated torque, object 0x6076, in Nm

    def to_nm(self, raw: int) -> float:
        """Return a torque [Nm] of counts [per mille of the rated torque]."""
        return raw * self.rated_torque_nm / 1000.0

    def to_raw(self, torque_nm: float, where: str) -> int:
        """Nearest count of a torque [Nm]; the object's INTEGER16 range applies."""
        exact = torque_nm * 1000.0 / self.rated_torque_nm
        count = _nearest_count(exact, *_INT16_RANGE)
        if count is None:
            raise CommandRefused(
                f"{where}: torque {torque_nm} Nm is {exact:.0f} per mille of rated "
                f"{self.rated_torque_nm:g} Nm, expected -32768 to 32767 (INTEGER16). "
                "Nothing was sent; lower the torque."
            )
        return count


@dataclass(frozen=True, slots=True)
class VelocityScale:
    """Counts of velocity actual value, 0x606C, to rad/s and back."""

    rad_s_per_count: float  # speed of one count [rad/s]

    @classmethod
    def from_object(cls, si_unit_velocity: int, where: str) -> VelocityScale:
        """Scale from object 0x60A9, SI unit velocity."""
        prefix = IntegerType.INTEGER8.decode(bytes([si_unit_velocity >> 24 & 0xFF]))
        angle = _RADIANS_OF_UNIT.get(si_unit_velocity >> 16 & 0xFF)
        time = _SECONDS_OF_UNIT.get(si_unit_velocity >> 8 & 0xFF)
        if angle is None or time is None or si_unit_velocity & 0xFF or abs(prefix) > _PREFIX_LIMIT:
            raise ConfigMismatch(
                f"{where}: SI unit velocity 0x60A9 is 0x{si_unit_velocity:08X}, expected a power of ten from "
                f"-{_PREFIX_LIMIT} to {_PREFIX_LIMIT}, then radian (10), degree (41) or revolution (B4) "
                "per second (03) or minute (47), such as 0xFDB44700. Set the drive's velocity unit."
            )
        return cls(10.0**prefix * angle / time)

    def to_rad_s(self, raw: int) -> float:
        """Return a speed [rad/s] of counts of 0x606C."""
        return raw * self.rad_s_per_count

    def to_raw(self, speed_rad_s: float, where: str) -> int:
        """Nearest count of a speed [rad/s]; the object's INTEGER32 range applies."""
        exact = speed_rad_s / self.rad_s_per_count
        count = _nearest_count(exact, *_INT32_RANGE)
        if count is None:
            raise CommandRefused(
                f"{where}: speed {speed_rad_s} rad/s is {exact:.0f} counts, expected -2147483648 to "
                "2147483647 (INTEGER32). Choose a coarser velocity unit in 0x60A9."
            )
        return count
