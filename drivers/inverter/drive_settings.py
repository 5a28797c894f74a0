"""What configuring gives a drive beside its PDO layouts: which object, which value, and who asks for it.

A dead host must mean zero torque, and three settings see to that together:

======== ==================================================================================
0x1016   the drive watches the host's heartbeat: a host whose program or cable is gone
0x14xx:5 the drive expects an RPDO that often: a host whose cycle hangs and whose heart beats
0x6007   what the drive does then: abort connection option code
======== ==================================================================================

The event timer of an RPDO is its deadline monitoring (CiA 301, 7.5.2.35): it runs from the first RPDO received,
and a drive that misses the next says EMCY 0x8250.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from drivers.canopen.can_link import HOST_NODE_ID
from drivers.canopen.pdo_map import PdoLayout
from drivers.canopen.sdo import object_name
from drivers.datasheet.file import EdsFile
from drivers.errors import ConfigMismatch
from drivers.inverter.settings import InverterSettings

SYNC_COB_ID_OBJECT: Final = 0x1005
SYNC_COUNTER_OVERFLOW: Final = 0x1019

ABORT_CONNECTION: Final = 0x6007

OPTION_CODES: Final = MappingProxyType(
    {
        ABORT_CONNECTION: "abort connection option code",
        0x605A: "quick stop option code",
        0x605B: "shutdown option code",
        0x605C: "disable operation option code",
        0x605D: "halt option code",
        0x605E: "fault reaction option code",
    }
)
"""What the drive does by itself when something ends (CiA 402-2)."""

TORQUE_SLOPE: Final = 0x6087

RPDO_EVENT_TIMER: Final = 5
"""Sub-index of an RPDO's communication parameter: its deadline [ms]."""

GUARD_TIME: Final = 0x100C
LIFE_TIME_FACTOR: Final = 0x100D

NO_ACTION: Final = 0
"""Abort connection option code that leaves the torque as it is."""


@dataclass(frozen=True, slots=True)
class DriveSetting:
    """One object that is written when a drive is configured, and read back.

    Attributes
    ----------
    index, subindex
        The object.
    name
        Its name in CiA 301 or CiA 402.
    value
        What it is given.
    source
        Who asks for it: rig file, EDS, or this program.
    watches_host
        Whether the drive watches the host by it; such a setting is made anew at every run.
    """

    index: int
    subindex: int
    name: str
    value: int
    source: str
    watches_host: bool = False

    def __str__(self) -> str:
        return f"{self.name} {object_name(self.index, self.subindex)}"


def drive_settings(eds: EdsFile, settings: InverterSettings, rpdo: PdoLayout) -> tuple[DriveSetting, ...]:
    """List what a drive is given, in the order of writing.

    Parameters
    ----------
    eds
        Which of the objects the drive has, and their values where the rig file is silent.
    settings
        What the rig file says.
    rpdo
        The RPDO that carries the torque command.

    Raises
    ------
    ConfigMismatch
        If the drive would keep its torque without the host, lacks an object the rig file has a value for, or is to
        be watched by node guarding.
    """
    listed = (
        *_sync(eds),
        *_no_sync_counter(eds),
        *_no_node_guarding(eds),
        *_option_codes(eds, settings),
        *_torque_slope(eds, settings),
        *_deadline(eds, settings, rpdo),
        *_heartbeats(settings),
    )
    for setting in listed:
        if (setting.index, setting.value) == (ABORT_CONNECTION, NO_ACTION):
            raise ConfigMismatch(
                f"{settings.where}: {setting} is to be 0, no action ({setting.source}): the torque would stay without "
                "the host. Expected 1 (fault), 2 (disable voltage) or 3 (quick stop). Set abort_connection under "
                "option_codes of this inverter in the rig file."
            )
    return listed


def _sync(eds: EdsFile) -> Iterator[DriveSetting]:
    if eds.has(SYNC_COB_ID_OBJECT):
        yield DriveSetting(SYNC_COB_ID_OBJECT, 0, "COB-ID SYNC", eds.default(SYNC_COB_ID_OBJECT), "EDS")


def _no_sync_counter(eds: EdsFile) -> Iterator[DriveSetting]:
    """Switch the SYNC counter off: the host sends none, and a drive that counts takes no other (CiA 301, 7.5.2.22)."""
    if eds.has(SYNC_COUNTER_OVERFLOW):
        yield DriveSetting(SYNC_COUNTER_OVERFLOW, 0, "SYNC counter overflow", 0, "this program")


def _no_node_guarding(eds: EdsFile) -> Iterator[DriveSetting]:
    if not (eds.has(GUARD_TIME) and eds.has(LIFE_TIME_FACTOR)):
        return
    guarded = eds.has_default(GUARD_TIME) and eds.has_default(LIFE_TIME_FACTOR)  # blank is off, as at power-on
    if guarded and eds.default(GUARD_TIME) and eds.default(LIFE_TIME_FACTOR):
        raise ConfigMismatch(
            f"EDS {eds.path}: node guarding is on (guard time {object_name(GUARD_TIME)} is {eds.default(GUARD_TIME)} "
            f"ms, life time factor {object_name(LIFE_TIME_FACTOR)} is {eds.default(LIFE_TIME_FACTOR)}), expected 0. "
            "Node guarding needs remote frames, which CiA 301 advises against and many adapters do not send, and it "
            "excludes the heartbeat, by which this program and the drive watch each other. Set both to 0 in the EDS."
        )
    yield DriveSetting(GUARD_TIME, 0, "guard time (heartbeat instead)", 0, "this program")
    yield DriveSetting(LIFE_TIME_FACTOR, 0, "life time factor (heartbeat instead)", 0, "this program")


def _option_codes(eds: EdsFile, settings: InverterSettings) -> Iterator[DriveSetting]:
    for index, name in OPTION_CODES.items():
        asked = settings.option_codes.get(index)
        if asked is not None:
            _require(eds, settings, index, name)
            yield DriveSetting(index, 0, name, asked, "rig file")
        elif eds.has(index):
            yield DriveSetting(index, 0, name, eds.default(index), "EDS")


def _torque_slope(eds: EdsFile, settings: InverterSettings) -> Iterator[DriveSetting]:
    if settings.torque_slope_nm_per_s is not None:
        _require(eds, settings, TORQUE_SLOPE, "torque slope")
        permille_per_s = round(1000.0 * settings.torque_slope_nm_per_s / settings.rated_torque_nm)
        yield DriveSetting(TORQUE_SLOPE, 0, "torque slope", permille_per_s, "rig file")


def _deadline(eds: EdsFile, settings: InverterSettings, rpdo: PdoLayout) -> Iterator[DriveSetting]:
    if eds.dictionary.get_variable(rpdo.communication_index, RPDO_EVENT_TIMER) is not None:
        index, deadline_ms = rpdo.communication_index, settings.rpdo_deadline_ms
        yield DriveSetting(index, RPDO_EVENT_TIMER, "RPDO event timer", deadline_ms, "rig file", watches_host=True)


def _heartbeats(settings: InverterSettings) -> Iterator[DriveSetting]:
    consumer = HOST_NODE_ID << 16 | settings.heartbeat_timeout_ms
    yield DriveSetting(0x1016, 1, "consumer heartbeat time", consumer, "rig file", watches_host=True)
    yield DriveSetting(0x1017, 0, "producer heartbeat time", settings.heartbeat_ms, "rig file", watches_host=True)


def _require(eds: EdsFile, settings: InverterSettings, index: int, name: str) -> None:
    if not eds.has(index):
        raise ConfigMismatch(
            f"{settings.where}: the rig file gives a value for {name} {object_name(index)}, which EDS {eds.path} "
            "does not have. Take the key out of the rig file, or use the EDS of the drive's firmware version."
        )
