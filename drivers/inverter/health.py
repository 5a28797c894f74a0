"""What is watched of an inverter while it runs: bus, other controllers, life signs, feedback that no longer changes."""

from __future__ import annotations

import time
from typing import Final

from drivers.canopen.can_link import CanLink
from drivers.canopen.emcy import EMCY_COB_ID
from drivers.canopen.heartbeat import HEARTBEAT_COB_ID
from drivers.canopen.node_monitor import NodeMonitor
from drivers.inverter.frozen_feedback import FrozenFeedback
from drivers.inverter.settings import InverterSettings

SDO_REQUEST_COB_ID: Final = 0x600
"""Plus the node id."""


class InverterHealth:
    """Watches one inverter on a link, from its making on.

    Parameters
    ----------
    link
        The bus it is on.
    settings
        What the rig file says of it.
    rpdos
        Identifiers of its RPDOs: nobody else may send them.

    Attributes
    ----------
    monitor
        Its heartbeat, NMT state and emergencies.
    frozen
        Whether its feedback stands still.
    """

    def __init__(self, link: CanLink, settings: InverterSettings, rpdos: tuple[int, ...]) -> None:
        self._link = link
        self.monitor = NodeMonitor(settings.where, settings.heartbeat_timeout_ms * 1_000_000)
        self.frozen = FrozenFeedback(settings.where)
        link.subscribe(HEARTBEAT_COB_ID + settings.node_id, self.monitor.on_heartbeat)
        link.subscribe(EMCY_COB_ID + settings.node_id, self.monitor.on_emergency)
        for cob_id in rpdos:
            link.strangers.claim(cob_id, f"{settings.where}: an RPDO")
        link.strangers.claim(SDO_REQUEST_COB_ID + settings.node_id, f"{settings.where}: an SDO request")

    def error_code(self) -> int | None:
        """Give the error code of the drive's last EMCY; None if it sent none."""
        emergency = self.monitor.emergency
        return None if emergency is None else emergency.code

    def raise_if_unwell(self) -> None:
        """Judge all of it.

        Raises
        ------
        DeviceFault
            If the drive has sent an EMCY, has left NMT OPERATIONAL, or sends the same feedback again and again while
            its command changes.
        DeviceTimeout
            If its heartbeat is lost, or never came.
        BusDown, ProtocolViolation
            If the bus is gone, or a frame could not be read.
        ForeignController
            If somebody else commands the drives, while the link is watched for that.
        """
        self._link.raise_if_failed()
        self._link.strangers.raise_if_seen()
        self.monitor.raise_if_unwell(time.monotonic_ns())
        self.frozen.raise_if_frozen()
