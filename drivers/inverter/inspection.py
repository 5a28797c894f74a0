"""What is to be known of an inverter by reading its objects: nothing here writes one."""

from __future__ import annotations

from dataclasses import replace

from drivers.canopen.can_link import CanLink
from drivers.canopen.sdo import SdoChannel
from drivers.canopen.sdo_node import SdoNode
from drivers.capability.carrier import ObjectId
from drivers.inverter.check import Difference, configurable_differences, fixed_differences, remarks
from drivers.inverter.commissioned import CommissionedValue, commissioned_values
from drivers.inverter.drive_settings import drive_settings
from drivers.inverter.pdos import InverterPdos
from drivers.inverter.protection import Protection, protections, require_protections
from drivers.inverter.settings import InverterSettings


class InspectedInverter:
    """One inverter on a link, compared with the rig file, its EDS and its DCF.

    Parameters
    ----------
    link
        The bus it is on.
    settings
        What the rig file says of it.

    Raises
    ------
    ConfigMismatch
        If the EDS can't be read, has no PDOs that carry the torque command and its feedback or can be made to, or would
        have the drive keep its torque without a host, and nobody has accepted that.
    """

    def __init__(self, link: CanLink, settings: InverterSettings) -> None:
        self.settings = settings
        self._link = link
        self._where = settings.where
        self._pdos = InverterPdos(settings)
        self._plan = self._pdos.plan
        self._given = drive_settings(self._plan, settings)
        require_protections(self._plan, settings)
        self._proof: dict[str, str] = {}
        node = SdoNode(settings.node_id, self._pdos.eds.dictionary)
        link.network.add_node(node)
        self._sdo = SdoChannel(node, self._pdos.eds, self._where, settings.sdo_timeout_s)

    def check(self) -> tuple[Difference, ...]:
        """Compare the device with rig file and EDS; reads objects, writes none."""
        return (
            *fixed_differences(self._sdo, self._plan, self.settings),
            *configurable_differences(self._sdo, self._plan, self.settings, self._given),
        )

    def remarks(self) -> tuple[str, ...]:
        """Say what a run will set that the drive does not have yet; reads objects, writes none."""
        return tuple(remarks(self._sdo, self._plan, self.settings, self._given))

    def commissioned(self) -> tuple[CommissionedValue, ...]:
        """List where DCF, device and rig file are not of one mind; empty without a DCF. Reads objects, writes none."""
        return tuple(commissioned_values(self._sdo, self._plan, self.settings))

    def protections(self) -> tuple[Protection, ...]:
        """List what stands between a dead host and torque, with what the last `prove_stop` has seen of it."""
        return tuple(
            replace(each, proof=self._proof.get(each.name, "")) for each in protections(self._plan, self.settings)
        )

    @property
    def count_rad_s(self) -> float:
        """One count of its speed [rad/s]."""
        return self._pdos.velocity.rad_s_per_count

    def read_speed_rad_s(self) -> float:
        """Read the velocity actual value 0x606C over SDO [rad/s]."""
        return self._pdos.velocity.to_rad_s(self._sdo.upload(0x606C))

    def read_channel(self, channel: ObjectId) -> int:
        """Read the count of a further object over SDO."""
        return self._sdo.upload(*channel)
