"""Faults of the simulated devices as a person writes them: ``m1.refuse_mode``, ``plc.clutch_closes@5.0``.

A moment is in seconds of simulated time, which passes with SYNC alone: a rig that nobody drives stands still.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final, TypeVar

from hil.errors import UsageError
from hil.simulator.fault_kind import Kind, Moment
from hil.simulator.inverter_settings import FaultAtStep, InverterFaults
from hil.simulator.plc_device import PlcFaults
from hil.simulator.plc_faults import PLC_KINDS
from hil.simulator.rig_server import RigFaults

F = TypeVar("F", InverterFaults, PlcFaults)

OVERCURRENT: Final = 0x2310
"""EMCY error code of CiA 402: continuous over current at the output."""

NOBODY: Final = (0xBAD, 0xBAD)
"""Vendor-ID and product code of no device."""

_SPEC = re.compile(r"(?P<device>\w+)\.(?P<kind>\w+)(?:@(?P<at_s>.+))?")


def _ignoring(index: int) -> Callable[[InverterFaults, Moment], InverterFaults]:
    return lambda faults, when: replace(faults, ignored_writes=faults.ignored_writes | {index})


INVERTER_KINDS: Final[Mapping[str, Kind[InverterFaults]]] = MappingProxyType(
    {
        "absent": Kind(False, lambda faults, when: replace(faults, absent=True)),
        "wrong_identity": Kind(False, lambda faults, when: replace(faults, identity=NOBODY)),
        "refuse_mode": Kind(False, _ignoring(0x6060)),
        "stuck": Kind(False, _ignoring(0x6040)),
        "hang": Kind(True, lambda faults, when: replace(faults, hang_at_step=when.step)),
        "fault": Kind(True, lambda faults, when: replace(faults, fault=FaultAtStep(when.step, OVERCURRENT))),
    }
)
DEVICES: Final[Mapping[str, Mapping[str, Kind[Any]]]] = MappingProxyType(
    {"m1": INVERTER_KINDS, "m2": INVERTER_KINDS, "plc": PLC_KINDS}
)


def known_faults() -> str:
    """List every fault in the way it is written, for help and messages; S stands for seconds."""
    written = {
        device: ", ".join(f"{name}@S" if kind.timed else name for name, kind in kinds.items())
        for device, kinds in DEVICES.items()
    }
    return f"m1.X or m2.X, X being {written['m1']}; plc.X, X being {written['plc']}"


def rig_faults(texts: Iterable[str], period_s: float) -> RigFaults:
    """Read faults ``DEVICE.KIND`` or ``DEVICE.KIND@S``.

    Parameters
    ----------
    texts
        As given to ``hil sim --fault``.
    period_s
        Simulated time of one SYNC [s].

    Raises
    ------
    UsageError
        If one is none of the known, has a moment too many or too few, or comes twice.
    """
    faults = RigFaults()
    known: set[tuple[str, str]] = set()
    for text in texts:
        device, name, at_s = _parsed(text)
        if (device, name) in known:
            raise UsageError(f"fault {text!r}: expected {device}.{name} once, came twice. Leave one out.")
        known.add((device, name))
        changed = DEVICES[device][name].put_into(getattr(faults, device), Moment(at_s, period_s))
        faults = replace(faults, **{device: changed})
    return faults


def _parsed(text: str) -> tuple[str, str, float]:
    match = _SPEC.fullmatch(text.strip())
    device, name, moment = match.group("device", "kind", "at_s") if match else ("", "", None)
    kind = DEVICES.get(device, {}).get(name)
    if kind is None:
        raise UsageError(f"fault {text!r}: expected one of {known_faults()}.")
    if not kind.timed and moment is not None:
        raise UsageError(f"fault {text!r}: expected no moment, came {moment!r}: it is there from the start.")
    if kind.timed and moment is None:
        raise UsageError(f"fault {text!r}: expected a moment in seconds, came none. Write {device}.{name}@5.0")
    return device, name, _seconds(text, moment) if moment is not None else 0.0


def _seconds(text: str, moment: str) -> float:
    try:
        at_s = float(moment)
    except ValueError:
        at_s = math.nan
    if not 0.0 <= at_s < math.inf:
        raise UsageError(f"fault {text!r}: expected seconds of simulated time, 0 or more, came {moment!r}.")
    return at_s
