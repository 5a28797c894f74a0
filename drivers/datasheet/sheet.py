"""What an EDS or DCF says of one node, asked for by index and sub-index. No bus, no file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from drivers.datasheet.number import read_number
from drivers.datasheet.objects import EdsEntry, EdsObject
from drivers.datasheet.text import EdsText

NODE_IDS: Final = range(1, 128)
BIT_RATES_KBIT_S: Final = range(10, 1001)


@dataclass(frozen=True, slots=True)
class Commissioning:
    """What a DCF says of the node it was written for (CiA 306, ``[DeviceComissioning]``).

    Attributes
    ----------
    node_id
        Its node id; None if it says none from 1 to 127.
    bit_rate_kbit_s
        Bit rate of its bus [kbit/s]; None if it says none from 10 to 1000.
    node_name
        Its name there; empty without one.
    """

    node_id: int | None = None
    bit_rate_kbit_s: int | None = None
    node_name: str = ""


@dataclass(frozen=True, slots=True)
class DataSheet:
    """One file, for one node.

    Attributes
    ----------
    path
        The file.
    objects
        Its objects.
    node_id
        What ``$NODEID`` stands for.
    commissioning
        Of a DCF; None of an EDS.
    """

    path: Path
    objects: Mapping[int, EdsObject]
    node_id: int
    commissioning: Commissioning | None = None

    @property
    def kind(self) -> str:
        """What kind of file it is, in messages."""
        return "EDS" if self.commissioning is None else "DCF"

    @property
    def commissioned_node(self) -> int | None:
        """Node id that the file was written for; None if it is for any."""
        return None if self.commissioning is None else self.commissioning.node_id

    def entry(self, index: int, subindex: int = 0) -> EdsEntry | None:
        """Look up one value of the object dictionary."""
        found = self.objects.get(index)
        return None if found is None else found.entries.get(subindex)

    def value(self, index: int, subindex: int = 0) -> int | None:
        """Value of an integer as the file has it; None if it lists none that can be read."""
        entry = self.entry(index, subindex)
        return None if entry is None else entry.value(self.node_id)

    def commissioned(self, index: int, subindex: int = 0) -> int | None:
        """Value that somebody gave the device, by a DCF; None if it has none."""
        entry = self.entry(index, subindex)
        return None if entry is None or entry.parameter_text is None else entry.value(self.node_id)


def read_commissioning(text: EdsText) -> Commissioning | None:
    """Read what a DCF says of its node; None for an EDS."""
    if not text.is_dcf:
        return None
    section = text.commissioning
    if section is None:
        return Commissioning()
    node_id, rate = (read_number(section.get(key) or "") for key in ("NodeID", "Baudrate"))
    return Commissioning(
        node_id=node_id if node_id in NODE_IDS else None,
        bit_rate_kbit_s=rate if rate in BIT_RATES_KBIT_S else None,
        node_name=section.get("NodeName") or "",
    )
