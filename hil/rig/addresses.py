"""A rig at other addresses than its file's, for example a simulated one on ports the system chose."""

from __future__ import annotations

from hil.config.rig_file import Rig
from hil.simulator.loopback import host_port


def with_addresses(rig: Rig, bus: str | None, modbus: str | None, take_over: bool = False) -> Rig:
    """Replace the addresses that are given; ``take_over`` lets another host be on the bus (`hil.rig.sole_host`)."""
    rig = rig.taking_over() if take_over else rig
    can, plc = rig.can, rig.plc
    if bus is not None:
        can = can.model_copy(update={"url": bus})
    if modbus is not None:
        address = host_port(modbus)
        plc = plc.model_copy(update={"host": address.host, "port": address.port})
    return rig.model_copy(update={"can": can, "plc": plc})
