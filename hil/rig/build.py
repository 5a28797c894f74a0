"""From the rig file to real devices: the only module that builds them.

A simulated rig is reached by the same drivers over the same protocols; only the addresses differ.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from drivers.canopen.can_link import CanLink
from drivers.inverter.inverter import Inverter
from drivers.inverter.settings import InverterSettings
from drivers.inverter.vehicle import Vehicle
from drivers.plc.plc import Plc
from drivers.plc.register_map import load_register_map
from drivers.resources import data_file
from drivers.torque_guard import TorqueGuard
from hil.config.rig_file import InverterTable, PlcTable, Rig
from hil.errors import UsageError
from hil.rig.channels import Channels
from hil.rig.plc_loop import PlcLoop
from hil.rig.sole_host import require_sole_host
from hil.simulator.addresses import is_simulated_bus

NAMES = ("m1", "m2")


@dataclass(frozen=True, slots=True)
class Devices:
    """Everything a run drives or asks, opened."""

    link: CanLink  # the CAN bus of both inverters
    m1: Inverter  # not configured yet; its settings are those of [inverters.m1]
    m2: Inverter  # the same of [inverters.m2]
    guard: TorqueGuard  # disabled; nothing else makes a torque command
    plc_loop: PlcLoop  # thread and event loop that `plc` belongs to
    plc: Plc  # Modbus client, connected; it is called through `plc_loop` alone
    channels: Channels  # [[channels]] of the rig file, besides torque and speed
    vehicle: Vehicle | None = None  # None: speeds are not compared with what torques make
    gateway_cob_ids: tuple[int, ...] = ()  # what the PLC's gateway sends on the bus


@contextmanager
def open_devices(rig: Rig, patience_s: float = 0.0) -> Iterator[Devices]:
    """Open bus and PLC of a rig; both are closed at the end of the block. No device is changed.

    ``patience_s`` is the least time that the drives, when they are configured, wait for the host's heartbeat, and the
    host for the PLC [s]; see `hil.rig.pacing.device_patience_s`.
    """
    _require_acceptances(rig)
    with CanLink.open(rig.can.url) as link, PlcLoop() as loop:
        m1, m2 = (Inverter(link, _watching(inverter_settings(name, rig), patience_s)) for name in NAMES)
        require_sole_host(link, rig, min(m1.settings.host_heartbeat_s, m2.settings.host_heartbeat_s))
        with connected_plc(rig.plc, loop, patience_s) as plc:
            channels = Channels(rig.channels, rig.register_map, {"m1": m1, "m2": m2}, loop, plc)
            guard = TorqueGuard(rig.guard_limits)
            yield Devices(link, m1, m2, guard, loop, plc, channels, rig.vehicle.vehicle, rig.plc.cob_ids)


def _watching(settings: InverterSettings, patience_s: float) -> InverterSettings:
    return replace(settings, host_timeout_ms=max(settings.host_timeout_ms, round(patience_s * 1000)))


def _require_acceptances(rig: Rig) -> None:
    """See that what real drives lack was accepted by a person; simulated ones hurt nobody."""
    if is_simulated_bus(rig.can.url):
        return
    for name in NAMES:
        table: InverterTable = getattr(rig.inverters, name)
        for key, acceptance in table.accepted.by_name.items():
            if not acceptance.is_by_a_person:
                raise UsageError(
                    f"rig {rig.name!r}, inverters.{name}.accepted.{key}: expected the name of who accepts it, and in "
                    f"words why, got {acceptance.by!r}, {acceptance.why!r}. Nobody has filled it in."
                )


@contextmanager
def connected_plc(table: PlcTable, loop: PlcLoop, patience_s: float) -> Iterator[Plc]:
    """Connect to the PLC on its loop; disconnected at the end of the block."""
    plc = plc_client(table, patience_s)
    loop.call(plc.connect())
    try:
        yield plc
    finally:
        loop.call(_close(plc))


def plc_client(table: PlcTable, patience_s: float = 0.0) -> Plc:
    """Make the PLC's client, not connected yet; it waits at least ``patience_s`` for whatever it waits for."""
    register_map = load_register_map(table.map or data_file("plc.toml"))
    security = None if table.security is None else table.security.client
    return Plc(table.host, table.port, register_map, patience_s=patience_s, security=security)


def inverter_settings(name: str, rig: Rig) -> InverterSettings:
    """Give the settings of one inverter, ``m1`` or ``m2``, as the drivers take them."""
    table: InverterTable = getattr(rig.inverters, name)
    return InverterSettings(
        name=name,
        node_id=table.node_id,
        rated_torque_nm=table.rated_torque_nm,
        torque_limit_nm=table.torque_limit_nm,
        mode=table.mode,
        eds_path=table.eds,
        vendor_id=table.vendor_id,
        product_code=table.product_code,
        serial_number=table.serial_number,
        heartbeat_ms=table.heartbeat_ms,
        host_node_id=rig.host_node_id,
        host_timeout_ms=table.host_timeout_ms,
        rpdo_deadline_ms=rig.rpdo_deadline_ms(table),
        option_codes=table.option_codes.by_object,
        torque_slope_nm_per_s=table.torque_slope_nm_per_s,
        speed_unit=None if table.speed_unit is None else table.speed_unit.speed_unit,
        rated_torque_unit_nm=table.rated_torque_unit.nm,
        accepted=table.accepted.by_name,
        follow_bit=table.follow_bit,
        sdo_timeout_s=table.sdo_timeout_s,
        mode_timeout_s=table.mode_timeout_s,
        state_timeout_s=table.state_timeout_s,
        speed_limit_rad_s=math.inf if rig.guard.speed_limit_rad_s is None else rig.guard.speed_limit_rad_s,
        channels=tuple(each.object_id for each in rig.channels if each.inverter == name and each.object_id is not None),
    )


async def _close(plc: Plc) -> None:
    """Close in the loop's own thread: the connection belongs to it."""
    plc.close()
