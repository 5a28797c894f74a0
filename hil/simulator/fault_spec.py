"""Faults of the simulated devices as a person writes them: ``m1.refuse_mode``, ``plc.clutch_closes@5.0``.

A moment is in seconds of simulated time, which passes with SYNC alone: a rig that nobody drives stands still. Some
faults take a size: ``m2.emcy@5.0=0x4210``, ``bus.lose=0.01``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final

from hil.errors import UsageError
from hil.simulator.bus_faults import BUS_KINDS
from hil.simulator.fault_kind import Kind, Moment
from hil.simulator.inverter_kinds import INVERTER_KINDS
from hil.simulator.plc_faults import PLC_KINDS
from hil.simulator.rig_server import RigFaults

_SPEC = re.compile(r"(?P<device>\w+)\.(?P<kind>\w+)(?:@(?P<at_s>[^=]+))?(?:=(?P<size>.+))?")

DEVICES: Final[Mapping[str, Mapping[str, Kind[Any]]]] = MappingProxyType(
    {"m1": INVERTER_KINDS, "m2": INVERTER_KINDS, "bus": BUS_KINDS, "plc": PLC_KINDS}
)


def known_faults() -> str:
    """List every fault in the way it is written, for help and messages; S stands for seconds."""
    written = {
        device: ", ".join(kind.written(name) for name, kind in kinds.items()) for device, kinds in DEVICES.items()
    }
    return f"m1.X or m2.X, X being {written['m1']}; bus.X, X being {written['bus']}; plc.X, X being {written['plc']}"


def rig_faults(texts: Iterable[str], period_s: float) -> RigFaults:
    """Read faults ``DEVICE.KIND[@S][=SIZE]``.

    Parameters
    ----------
    texts
        As given to ``hil sim --fault``.
    period_s
        Simulated time of one SYNC [s].

    Raises
    ------
    UsageError
        If one is none of the known, has a moment or a size too many, too few or wrong, or comes twice.
    """
    faults = RigFaults()
    known: set[tuple[str, str, Any]] = set()
    for text in texts:
        asked = _Asked.parse(text)
        moment = asked.moment(period_s)
        once = (asked.device, asked.name, moment.size if asked.kind.adds_up else None)
        if once in known:
            raise UsageError(f"fault {text!r}: expected {asked.device}.{asked.name} once, got twice. Leave one out.")
        known.add(once)
        faults = replace(faults, **{asked.device: asked.kind.put_into(getattr(faults, asked.device), moment)})
    return faults


@dataclass(frozen=True, slots=True)
class _Asked:
    """One fault as a person wrote it, and the entry of the table it names."""

    text: str
    device: str
    name: str
    kind: Kind[Any]
    at_s: str | None
    size: str | None

    @classmethod
    def parse(cls, text: str) -> _Asked:
        match = _SPEC.fullmatch(text.strip())
        device, name, at_s, size = match.group("device", "kind", "at_s", "size") if match else ("", "", None, None)
        kind = DEVICES.get(device, {}).get(name)
        if kind is None:
            raise UsageError(f"fault {text!r}: expected one of {known_faults()}.")
        return cls(text, device, name, kind, at_s, size)

    def moment(self, period_s: float) -> Moment:
        return Moment(self._seconds(), period_s, self._size())

    def _seconds(self) -> float:
        if self.at_s is None:
            if self.kind.timed and not self.kind.since_start:
                raise UsageError(
                    f"fault {self.text!r}: expected a moment in seconds, got none. Write {self.device}.{self.name}@5.0"
                )
            return 0.0
        if not self.kind.timed:
            raise UsageError(f"fault {self.text!r}: expected no moment, got {self.at_s!r}: it is there from the start.")
        try:
            at_s = float(self.at_s)
        except ValueError:
            at_s = math.nan
        if not 0.0 <= at_s < math.inf:
            raise UsageError(f"fault {self.text!r}: expected seconds of simulated time, 0 or more, got {self.at_s!r}.")
        return at_s

    def _size(self) -> Any:
        size = self.kind.size
        if size is None:
            if self.size is not None:
                raise UsageError(f"fault {self.text!r}: expected nothing after its name, got '={self.size}'.")
            return None
        if self.size is None:
            if size.default is None:
                raise UsageError(
                    f"fault {self.text!r}: expected {size.expected}, got none. "
                    f"Write {self.device}.{self.kind.written(self.name)}"
                )
            return size.default
        try:
            return size.read(self.size)
        except ValueError as error:
            raise UsageError(f"fault {self.text!r}: expected {size.expected}, got {self.size!r}.") from error
