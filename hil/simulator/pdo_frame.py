"""Frames of a simulated node's PDOs, whatever is mapped: whole objects of 1 to 64 bits, one after the other.

The first object has the least significant bits (CiA 301, 7.1.4). The host's own codec knows integers of 8, 16 and 32
bit alone, for it uses no others; makers map flags and long numbers too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drivers.canopen.pdo_map import MAX_PDO_BYTES, MappedObject, PdoLayout

Read = Callable[[], int]


@dataclass(frozen=True, slots=True)
class PdoFrame:
    """One PDO's frames.

    Attributes
    ----------
    layout
        The PDO.
    signed
        Whether each mapped object may be negative.
    """

    layout: PdoLayout
    signed: tuple[bool, ...]

    @property
    def bits(self) -> int:
        """Bits mapped."""
        return sum(mapped.length_bits for mapped in self.layout.objects)

    @property
    def size_bytes(self) -> int:
        """Length of a frame."""
        return (self.bits + 7) // 8

    @property
    def fits(self) -> bool:
        """Whether a CAN frame can hold it."""
        return self.size_bytes <= MAX_PDO_BYTES

    def pack(self, values: Sequence[int]) -> bytes:
        """Build a frame; of a value that is too long the upper bits are lost, as in a drive."""
        number, at = 0, 0
        for mapped, value in zip(self.layout.objects, values, strict=True):
            number |= (value & (1 << mapped.length_bits) - 1) << at
            at += mapped.length_bits
        return number.to_bytes(self.size_bytes, "little")

    def unpack(self, data: bytes) -> list[tuple[MappedObject, int]]:
        """Read the objects' values from a frame of the right length."""
        number, found = int.from_bytes(data, "little"), []
        for mapped, signed in zip(self.layout.objects, self.signed, strict=True):
            value = number & (1 << mapped.length_bits) - 1
            number >>= mapped.length_bits
            negative = signed and value >> mapped.length_bits - 1
            found.append((mapped, value - (1 << mapped.length_bits) if negative else value))
        return found
