"""Look for every device of a rig file and compare it: reads only, arms nothing, commands no torque."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from urllib.parse import parse_qsl, urlsplit

from drivers.canopen.can_link import CanLink
from drivers.datasheet.file import EdsFile
from drivers.datasheet.text import Severity
from drivers.eds_check import check_eds
from drivers.errors import DeviceFault, DriverError, ProtocolViolation
from drivers.inverter.check import Difference
from drivers.inverter.cob_ids import shared_cob_ids
from drivers.inverter.inspection import CommissionedValue
from drivers.inverter.inverter import Inverter
from drivers.inverter.stop_proof import Protection
from drivers.inverter.supervision import speed_tolerance_rad_s
from drivers.plc.named_registers import Reading
from drivers.plc.reader import Backoff, PlcReader
from drivers.plc.types import PlcStatus
from hil.config.channel_table import ChannelTable
from hil.config.rig_file import InverterTable, PlcTable, Rig
from hil.rig.build import inverter_settings, plc_client
from hil.rig.plc_watch import Needs, max_speed_rad_s, plc_limits, reasons_against
from hil.rig.sole_host import require_sole_host

NO_NEEDS = Needs(torque_of_one_nm=0.0)
"""A check asks for no torque."""

PLC_BACKOFF = Backoff(first_s=0.1, longest_s=0.2, attempts=3)
"""A person waits for a check: a connection lost once is made again, a PLC that is not there is soon said to be."""


MAP = "register map"
"""Where it stands what a register should hold."""


class DeviceVerdict(Enum):
    """What came of looking for one device."""

    AGREES = "agrees"
    DIFFERS = "differs"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class ChannelReading:
    """What a channel reads."""

    channel: ChannelTable  # as the rig file has it
    value: float | None  # in SI units


@dataclass(frozen=True, slots=True)
class DeviceFinding:
    """One device."""

    device: str  # its name in the rig file
    address: str  # where it was looked for
    verdict: DeviceVerdict  # what came of it
    differences: tuple[Difference, ...] = ()  # what does not agree
    notes: tuple[str, ...] = ()  # why it failed, or what would keep it from a run at present
    remarks: tuple[str, ...] = ()  # what a run will set by itself, and what the drive keeps of its own
    commissioned: tuple[CommissionedValue, ...] = ()  # where DCF, device and rig file are not of one mind
    protections: tuple[Protection, ...] = ()  # what stands between a dead host and torque
    registers: tuple[Reading, ...] = ()  # what the registers of a PLC hold
    channels: tuple[ChannelReading, ...] = ()  # what the further channels of the rig file read at this device
    max_speed_rad_s: float | None = None  # the largest speed that a drive gives for itself [rad/s], where it does
    dead_cycles: int | None = None  # from a command to the answer that shows it, where a stop proof has counted them
    questions: tuple[str, ...] = ()  # what only someone who knows the vehicle can confirm


def check_rig(rig: Rig, prove_stop: bool = False) -> tuple[DeviceFinding, ...]:
    """Look for the CAN bus, both inverters and the PLC; each, whatever is wrong with the others."""
    drives = _can(rig, prove_stop)
    speeds = [each.max_speed_rad_s for each in drives if each.max_speed_rad_s is not None]
    return (*drives, _plc(rig, min(speeds, default=None)))


def _can(rig: Rig, prove_stop: bool) -> tuple[DeviceFinding, ...]:
    tables = {"m1": rig.inverters.m1, "m2": rig.inverters.m2}
    try:
        link = CanLink.open(rig.can.url)
    except DriverError as error:
        bus = DeviceFinding("can", rig.can.url, DeviceVerdict.FAILED, notes=(str(error),))
        lost = ("its bus is not there",)
        return (
            bus,
            *(DeviceFinding(name, _node(table), DeviceVerdict.FAILED, notes=lost) for name, table in tables.items()),
        )
    with link:
        require_sole_host(link, rig, inverter_settings("m1", rig).host_heartbeat_s if prove_stop else None)
        bus = DeviceFinding("can", rig.can.url, DeviceVerdict.AGREES)
        made: dict[str, Inverter] = {}
        m1, m2 = (_inverter(link, name, rig, prove_stop, made) for name in tables)
        if len(made) == len(tables):
            m2 = _or_failed("m2", m2.address, lambda: _one_shaft(m2, made["m1"], made["m2"]))
            return _one_bus((bus, m1, m2), made["m1"], made["m2"], rig.plc.cob_ids)
        return bus, m1, m2


def _one_bus(
    findings: tuple[DeviceFinding, ...], m1: Inverter, m2: Inverter, gateway: Sequence[int]
) -> tuple[DeviceFinding, ...]:
    """See that each COB-ID is used once; what is not stands with the drive whose it is, the gateway's with the bus."""
    bus, *drives = findings
    try:
        shared = tuple(shared_cob_ids(m1, m2, gateway))
    except DriverError as error:
        return replace(bus, verdict=DeviceVerdict.FAILED, notes=(*bus.notes, str(error))), *drives
    of_drives = [tuple(each for each in shared if each.where == drive.settings.where) for drive in (m1, m2)]
    of_bus = tuple(each for each in shared if all(each not in those for those in of_drives))
    return tuple(map(_differing, findings, (of_bus, *of_drives)))


def _differing(finding: DeviceFinding, differences: tuple[Difference, ...]) -> DeviceFinding:
    if not differences:
        return finding
    return replace(finding, verdict=DeviceVerdict.DIFFERS, differences=(*finding.differences, *differences))


def _one_shaft(finding: DeviceFinding, m1: Inverter, m2: Inverter) -> DeviceFinding:
    """Compare the speeds that both read of their one shaft, at rest or coasting."""
    one, other = m1.read_speed_rad_s(), m2.read_speed_rad_s()
    if abs(one - other) <= speed_tolerance_rad_s(one, other, m1.count_rad_s + m2.count_rad_s):
        return finding
    difference = Difference(
        m2.settings.where,
        "velocity actual value 0x606C",
        f"the {one:.3g} rad/s that m1 reads, for both turn with one shaft",
        f"{other:.3g} rad/s",
        "m1",
    )
    return replace(finding, verdict=DeviceVerdict.DIFFERS, differences=(*finding.differences, difference))


def _inverter(link: CanLink, name: str, rig: Rig, prove_stop: bool, made: dict[str, Inverter]) -> DeviceFinding:
    table: InverterTable = getattr(rig.inverters, name)

    def compare() -> DeviceFinding:
        inverter = Inverter(link, inverter_settings(name, rig))
        differences, fault = inverter.check(), inverter.fault()
        if prove_stop and not differences and fault is None:
            differences = inverter.prove_stop(rig.period_s)
        made[name] = inverter
        verdict = DeviceVerdict.DIFFERS if differences else DeviceVerdict.AGREES
        notes = (*_eds_note(table.eds), *(() if fault is None else (fault,)))
        return DeviceFinding(
            name,
            address,
            verdict,
            differences,
            notes,
            inverter.remarks(),
            (*_rate(table, rig.can.url), *inverter.commissioned()),
            inverter.protections(),
            channels=tuple(_objects_read(inverter, name, rig)),
            max_speed_rad_s=max_speed_rad_s(inverter),
            dead_cycles=inverter.dead_cycles,
        )

    address = _node(table)
    return _or_failed(name, address, compare)


def _objects_read(inverter: Inverter, name: str, rig: Rig) -> Iterator[ChannelReading]:
    for channel in rig.channels:
        if channel.inverter == name and channel.object_id is not None:
            yield ChannelReading(channel, inverter.read_channel(channel.object_id) * (channel.scale or 1.0))


def _registers_read(registers: Sequence[Reading], rig: Rig) -> Iterator[ChannelReading]:
    read = {each.name: each.value for each in registers}
    for channel in rig.channels:
        if channel.register_name is not None:
            value = read[channel.register_name]
            yield ChannelReading(channel, None if value is None else float(value) * channel.factor(rig.register_map))


def _eds_note(path: Path | None) -> tuple[str, ...]:
    """Say that a rig's own EDS has errors, which may matter later than now."""
    report = None if path is None else check_eds(path)
    if report is None or report.usable:
        return ()
    return (f"EDS {path} has errors ({report.count(Severity.ERROR)}). See: hil check --eds {path}",)


def _rate(table: InverterTable, can_url: str) -> Iterator[CommissionedValue]:
    """Compare the bit rate of a DCF with that of the bus URL, where both say one [kbit/s]."""
    bitrate = dict(parse_qsl(urlsplit(can_url).query)).get("bitrate", "")
    if table.eds is None or not bitrate.isdecimal():
        return
    commissioning = EdsFile(table.eds, table.node_id).sheet.commissioning
    rate = None if commissioning is None else commissioning.bit_rate_kbit_s
    if rate is not None and rate * 1000 != int(bitrate):
        yield CommissionedValue("bit rate", f"{rate} kbit/s", "", f"{int(bitrate) / 1000:g} kbit/s")


def _node(table: InverterTable) -> str:
    return f"node {table.node_id}"


def _plc(rig: Rig, drives_rad_s: float | None) -> DeviceFinding:
    def compare() -> DeviceFinding:
        registers, status, refusals = asyncio.run(_asked(rig.plc))
        differences = tuple(
            Difference(
                "plc",
                f"{each.name}, {each.register.kind.value} {each.register.address}",
                each.expected,
                each.problem,
                MAP,
            )
            for each in registers
            if each.problem is not None
        )
        limits = () if status is None else tuple(plc_limits(status, rig, drives_rad_s))
        differences += tuple(
            Difference("plc", each.what, f"at most {each.most}", each.found, MAP)
            for each in limits
            if not each.believed
        )
        notes = (*refusals, *(() if status is None else reasons_against(status, NO_NEEDS)))
        return DeviceFinding(
            "plc",
            address,
            DeviceVerdict.DIFFERS if differences else DeviceVerdict.AGREES,
            differences,
            notes,
            registers=registers,
            questions=tuple(each.question for each in limits),
            channels=tuple(_registers_read(registers, rig)),
        )

    address = f"{rig.plc.host}:{rig.plc.port}"
    return _or_failed("plc", address, compare)


async def _asked(table: PlcTable) -> tuple[tuple[Reading, ...], PlcStatus | None, tuple[str, ...]]:
    """Read every register, and the status where they can be believed: after a beat, as a run does.

    A PLC that lets this host only read says so; that is the third.
    """
    async with PlcReader(plc_client(table), PLC_BACKOFF) as reader:
        registers = await reader.read_registers()
        if any(each.problem is not None for each in registers):
            return registers, None, ()
        try:
            return registers, await reader.greet(), ()
        except (DeviceFault, ProtocolViolation) as refusal:
            status = await reader.read_status()
            return registers, status, (f"the host's beat is not taken, so that no run is possible: {refusal}",)


def _or_failed(device: str, address: str, compare: Callable[[], DeviceFinding]) -> DeviceFinding:
    try:
        return compare()
    except DriverError as error:
        return DeviceFinding(device, address, DeviceVerdict.FAILED, notes=(str(error),))
