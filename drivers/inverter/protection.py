"""What stands between a dead host and torque, drive by drive.

==================== ==========================================================================================
heartbeat_consumer   0x1016: the drive watches the host's heartbeat: program, computer or cable gone
rpdo_deadline        0x14xx:05: it expects an RPDO that often: a host whose cycle hangs and whose heart beats
abort_connection     0x6007: what it does then; without it that is not known from the data sheet
sync_loss            0x1006: it may watch SYNC; what it makes of that is its maker's
drive_watchdog       the drive's own, as its maker names it
==================== ==========================================================================================

The first three are to be there or accepted by name in the rig file; the others are reported, for they may be the
reason. The event timer of an RPDO is its deadline monitoring (CiA 301, 7.5.2.35): it runs from the first RPDO received,
and a drive that misses the next says EMCY 0x8250.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from drivers.canopen.sdo import object_name
from drivers.capability.function import Function
from drivers.capability.plan import DrivePlan
from drivers.capability.table import EVENT_TIMER
from drivers.errors import ConfigMismatch
from drivers.inverter.acceptance import Acceptance, acceptance_line
from drivers.inverter.drive_settings import ABORT_CONNECTION, NO_ACTION, chosen_code
from drivers.inverter.settings import InverterSettings

SYNC_PERIOD: Final = 0x1006
ERROR_BEHAVIOUR: Final = (0x1029, 1)

REACTIONS: Final[Mapping[int, str]] = {1: "fault", 2: "disable voltage", 3: "quick stop"}
"""Of the abort connection option code (CiA 402-2)."""

_BEHAVIOURS: Final[Mapping[int, str]] = {0: "NMT PRE-OPERATIONAL", 1: "no change of state", 2: "NMT STOPPED"}
"""Of the error behaviour for communication errors (CiA 301)."""

_WATCHDOG: Final = re.compile(
    r"watch ?dog|(comm|communication|bus|can|host|master)[\w ]*(loss|lost|time ?out|time-out|monitor)", re.IGNORECASE
)
"""Names that makers give to a watchdog of their own."""

_MANUFACTURER: Final = range(0x2000, 0x6000)

NEEDED: Final = ("heartbeat_consumer", "rpdo_deadline", "abort_connection")
"""What is to be there, or accepted."""


@dataclass(frozen=True, slots=True)
class Protection:
    """One thing that takes the torque away without the host.

    Attributes
    ----------
    name
        Its name in the rig file.
    against
        What it notices, or does.
    by
        Object and setting by which it is there; empty if it is missing.
    accepted
        Who accepted that it is missing; None if nobody.
    proof
        What a stop proof has seen of it; empty before one.
    """

    name: str
    against: str
    by: str = ""
    accepted: Acceptance | None = None
    proof: str = ""

    @property
    def in_order(self) -> bool:
        """Whether it is there, or does not have to be."""
        return bool(self.by) or self.accepted is not None or self.name not in NEEDED

    def __str__(self) -> str:
        state = self.by or ("none" if self.accepted is None else f"none, {self.accepted}")
        return f"{self.name}: {state}{f'; {self.proof}' if self.proof else ''}"


def protections(plan: DrivePlan, settings: InverterSettings) -> tuple[Protection, ...]:
    """List what a drive has, by its data sheet and the rig file."""
    return tuple(_protections(plan, settings))


def require_protections(plan: DrivePlan, settings: InverterSettings) -> None:
    """See that nothing is missing that nobody has accepted."""
    missing = [each for each in protections(plan, settings) if not each.in_order]
    if missing:
        reasons = "; ".join(f"{each.name} ({each.against})" for each in missing)
        lines = "; ".join(acceptance_line(each.name) for each in missing)
        raise ConfigMismatch(
            f"{settings.where}: by its {plan.sheet.kind} the drive lacks what takes its torque away without the host: "
            f"{reasons}. Expected each to be there, or accepted in [inverters.{settings.name}] of the rig file by name "
            f"and with the reason: {lines}"
        )


def _protections(plan: DrivePlan, settings: InverterSettings) -> Iterator[Protection]:
    accepted = settings.accepted
    watched = plan.has(Function.HEARTBEAT_CONSUMER), plan.has(Function.RPDO_DEADLINE)
    yield Protection(
        "heartbeat_consumer",
        "host, computer or cable gone",
        f"{object_name(0x1016, 1)}, {settings.host_timeout_ms} ms" if watched[0] else "",
        accepted.get("heartbeat_consumer"),
    )
    parts = plan.abilities[Function.RPDO_DEADLINE].parts
    yield Protection(
        "rpdo_deadline",
        "cycle of the host hangs while its heart beats",
        f"{object_name(parts[0].index, EVENT_TIMER)}, {settings.rpdo_deadline_ms} ms" if parts else "",
        accepted.get("rpdo_deadline"),
    )
    yield Protection(
        "abort_connection",
        "what the drive does when it notices",
        _reaction(plan, settings) if any(watched) else "nothing is noticed, so nothing is to be done",
        accepted.get("abort_connection"),
    )
    yield Protection("sync_loss", "SYNC gone", _sync_period(plan))
    yield Protection("drive_watchdog", "whatever its maker has it watch", _own_watchdogs(plan))


def _reaction(plan: DrivePlan, settings: InverterSettings) -> str:
    if not plan.has(Function.ABORT_CONNECTION):
        return ""
    chosen = chosen_code(plan, settings, ABORT_CONNECTION)
    code = plan.sheet.value(ABORT_CONNECTION) if chosen is None else chosen[0]
    if code == NO_ACTION:
        return ""
    shown = "the drive's own" if code is None else f"{code} ({REACTIONS.get(code, 'the maker has it')})"
    behaviour = plan.sheet.value(*ERROR_BEHAVIOUR)
    more = (
        f", {object_name(*ERROR_BEHAVIOUR)} {_BEHAVIOURS[behaviour]}"
        if behaviour is not None and behaviour in _BEHAVIOURS
        else ""
    )
    return f"{object_name(ABORT_CONNECTION)} {shown}{more}"


def _sync_period(plan: DrivePlan) -> str:
    return "" if plan.sheet.entry(SYNC_PERIOD) is None else f"{object_name(SYNC_PERIOD)} is there: see the manual"


def _own_watchdogs(plan: DrivePlan) -> str:
    found = [
        f"0x{index:04X} {described.section.get('ParameterName')}"
        for index, described in plan.sheet.objects.items()
        if index in _MANUFACTURER and _WATCHDOG.search(described.section.get("ParameterName") or "")
    ]
    return f"{', '.join(found)}: see the manual" if found else ""
