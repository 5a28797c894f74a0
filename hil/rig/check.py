"""Look for every device of a rig file and compare it: reads only, arms nothing, commands no torque."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from drivers.can_link import CanLink
from drivers.errors import DriverError
from drivers.inverter import Inverter
from drivers.inverter_check import Difference
from hil.config.rig_file import InverterTable, PlcTable, Rig
from hil.rig.build import connected_plc, inverter_settings
from hil.rig.fitness import Needs, reasons_against
from hil.rig.plc_loop import PlcLoop

NO_NEEDS = Needs(torque_of_one_nm=0.0)
"""A check asks for no torque."""


class Verdict(Enum):
    """What came of looking for one device."""

    AGREES = "agrees"
    DIFFERS = "differs"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Finding:
    """One device.

    Attributes
    ----------
    device
        Its name in the rig file.
    address
        Where it was looked for.
    verdict
        What came of it.
    differences
        What does not agree; empty unless it differs.
    notes
        Why it failed, or what would keep it from a run at present.
    """

    device: str
    address: str
    verdict: Verdict
    differences: tuple[Difference, ...] = ()
    notes: tuple[str, ...] = ()


def check_rig(rig: Rig) -> tuple[Finding, ...]:
    """Look for the CAN bus, both inverters and the PLC; each, whatever is wrong with the others."""
    return (*_can(rig), _plc(rig.plc))


def _can(rig: Rig) -> tuple[Finding, ...]:
    tables = {"m1": rig.inverters.m1, "m2": rig.inverters.m2}
    try:
        link = CanLink.open(rig.can.url)
    except DriverError as error:
        bus = Finding("can", rig.can.url, Verdict.FAILED, notes=(str(error),))
        lost = ("its bus is not there",)
        return (
            bus,
            *(Finding(name, _node(table), Verdict.FAILED, notes=lost) for name, table in tables.items()),
        )
    with link:
        bus = Finding("can", rig.can.url, Verdict.AGREES)
        return (bus, *(_inverter(link, name, table) for name, table in tables.items()))


def _inverter(link: CanLink, name: str, table: InverterTable) -> Finding:
    def compare() -> Finding:
        inverter = Inverter(link, inverter_settings(name, table))
        differences, fault = inverter.check(), inverter.fault()
        verdict = Verdict.DIFFERS if differences else Verdict.AGREES
        return Finding(name, address, verdict, differences, () if fault is None else (fault,))

    address = _node(table)
    return _or_failed(name, address, compare)


def _node(table: InverterTable) -> str:
    return f"node {table.node_id}"


def _plc(table: PlcTable) -> Finding:
    def compare() -> Finding:
        with PlcLoop() as loop, connected_plc(table, loop) as plc:
            status = loop.call(plc.read_status())
        return Finding("plc", address, Verdict.AGREES, notes=tuple(reasons_against(status, NO_NEEDS)))

    address = f"{table.host}:{table.port}"
    return _or_failed("plc", address, compare)


def _or_failed(device: str, address: str, compare: Callable[[], Finding]) -> Finding:
    try:
        return compare()
    except DriverError as error:
        return Finding(device, address, Verdict.FAILED, notes=(str(error),))
