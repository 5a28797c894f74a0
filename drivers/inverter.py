"""A traction inverter on CANopen: CiA 402 torque modes, driven by SYNC.

Order of use: ``check`` (reads only), ``configure``, ``arm``, then in each cycle ``command``, `CanLink.sync`,
``await_feedback``, ``raise_if_faulted``; at the end, always, ``disarm``. Arming and disarming go by SDO and
are confirmed object by object; ``canopen``'s own CiA 402 node is not used, for its mode setter reports
success when the drive has not followed.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from drivers.can_link import HOST_NODE_ID, CanLink
from drivers.cia402 import Command
from drivers.eds_file import EdsFile
from drivers.emcy import EMCY_COB_ID
from drivers.errors import CommandRefused, ConfigMismatch, DriverError
from drivers.feedback import FeedbackReceiver, InverterFeedback
from drivers.heartbeat import HEARTBEAT_COB_ID, NMT_COB_ID, NmtCommand, NmtState, nmt_frame
from drivers.inverter_check import (
    Difference,
    configurable_differences,
    configured_objects,
    fixed_differences,
)
from drivers.inverter_settings import InverterSettings
from drivers.node_monitor import NodeMonitor
from drivers.pdo_map import (
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    TPDO_COMMUNICATION,
    TPDO_MAPPING,
    PdoCodec,
    PdoLayout,
    configuration_writes,
)
from drivers.power_control import PowerControl
from drivers.scaling import TorqueScale, VelocityScale
from drivers.sdo import SdoChannel
from drivers.sdo_node import SdoNode
from drivers.torque_guard import GuardedTorque

__all__ = ["Difference", "Inverter", "InverterFeedback", "InverterSettings"]

_COMMAND_OBJECTS = (0x6040, 0x6071, 0x60B2)
_FEEDBACK_OBJECTS = (0x6041, 0x6077, 0x606C)


class Inverter:
    """One inverter on a link.

    Parameters
    ----------
    link
        The bus it is on.
    settings
        What the rig file says of it.

    Raises
    ------
    ConfigMismatch
        If the EDS can't be read or has no PDOs that carry the torque command and its feedback.
    """

    def __init__(self, link: CanLink, settings: InverterSettings) -> None:
        self.settings = settings
        self._link = link
        self._where = settings.where
        self._eds = EdsFile(settings.eds_path, settings.node_id)
        self._torque = TorqueScale(settings.rated_torque_nm)
        self._rpdo = self._command_codec()
        self._tpdo = self._codec(TPDO_COMMUNICATION, TPDO_MAPPING, _FEEDBACK_OBJECTS)
        node = SdoNode(settings.node_id, self._eds.dictionary)
        link.network.add_node(node)
        self._sdo = SdoChannel(node, self._eds, self._where, settings.sdo_timeout_s)
        self._power = PowerControl(self._sdo, settings)
        self._feedback = self._subscribe_feedback()
        self._monitor = self._subscribe_monitor()
        self._armed = False

    @property
    def latest(self) -> InverterFeedback | None:
        """The last feedback received; None before the first after `configure`."""
        return self._feedback.latest

    def check(self) -> tuple[Difference, ...]:
        """Compare the device with rig file and EDS; reads objects, writes none.

        Returns
        -------
        tuple of Difference
            Empty if everything agrees.

        Raises
        ------
        DeviceTimeout
            If the node does not answer.
        ConfigMismatch
            If it lacks an object of the EDS.
        """
        return (
            *fixed_differences(self._sdo, self._eds, self.settings),
            *configurable_differences(self._sdo, self._eds, self.settings, self._layouts),
        )

    def fault(self) -> str | None:
        """Tell what fault the drive is in: power state, error code in words, what to do; None without fault.

        Reads objects, writes none.

        Raises
        ------
        DeviceTimeout
            If the node does not answer.
        ProtocolViolation
            If its statusword is none of CiA 402.
        """
        return self._power.fault()

    def configure(self) -> None:
        """Give the device the EDS's PDO layout and option codes, start heartbeats and NMT operation.

        Every write is read back; NMT OPERATIONAL is confirmed by the node's heartbeat.

        Raises
        ------
        ConfigMismatch
            If identity, rated torque, scale, limit or modes differ, or a write does not hold.
        DeviceTimeout
            If the node does not answer or does not become operational.
        """
        self._armed = False
        self._monitor.expect(None)
        self._send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        if differences := tuple(fixed_differences(self._sdo, self._eds, self.settings)):
            raise ConfigMismatch(
                f"{'; '.join(map(str, differences))}. Correct the rig file, or connect the drive it describes."
            )
        for index in configured_objects(self._eds):
            self._sdo.download_confirmed(index, 0, self._eds.default(index))
        for layout in self._layouts:
            for index, subindex, value in configuration_writes(layout):
                self._sdo.download_confirmed(index, subindex, value)
        self._start_heartbeats()
        self._feedback.start_anew()
        self._send_nmt(NmtCommand.START)
        self._monitor.await_state(NmtState.OPERATIONAL, self.settings.state_timeout_s)
        self._monitor.expect(NmtState.OPERATIONAL)

    def arm(self) -> None:
        """Select the torque mode and step to OPERATION_ENABLED at zero torque, each step confirmed.

        Raises
        ------
        ConfigMismatch
            If the drive refuses the mode.
        DeviceTimeout
            If mode or state does not follow in time; both values are named.
        DeviceFault
            If the drive is in FAULT.
        """
        self._power.select_mode()
        self._power.zero_targets()
        self._power.enable_operation()
        self._armed = True

    def command(self, torque: GuardedTorque) -> None:
        """Send one RPDO; the drive puts it into effect at the next SYNC.

        Raises
        ------
        CommandRefused
            If the drive is not armed, or the torque does not fit its object.
        BusDown
            If the bus is gone.
        """
        if not self._armed:
            raise CommandRefused(
                f"{self._where}: {torque.base_nm} Nm commanded while disarmed, expected arm() before. Nothing was sent."
            )
        base = self._torque.to_raw(torque.base_nm, self._where)
        prbs = self._torque.to_raw(torque.prbs_nm, self._where)
        self._send_rpdo(Command.ENABLE_OPERATION, base, prbs)

    def await_feedback(self, after_ns: int, timeout_s: float) -> InverterFeedback | None:
        """Wait for the TPDO received after ``after_ns``, the result of `CanLink.sync` [ns].

        Returns
        -------
        InverterFeedback or None
            None if none came in ``timeout_s``.
        """
        return self._feedback.await_after(after_ns, timeout_s)

    def disarm(self) -> None:
        """Take the torque to zero and leave OPERATION_ENABLED, confirmed by the statusword.

        Everything is tried before anything is raised; if the state can't be confirmed, the node is sent to
        PRE-OPERATIONAL too, where its abort connection option (0x6007) takes the torque away.

        Raises
        ------
        DriverError
            The first of the steps' errors, the others as its notes.
        """
        self._armed = False
        errors = _try_all(
            # Overwrites the RPDO still waiting for SYNC: it would enable the drive again.
            lambda: self._send_rpdo(Command.DISABLE_VOLTAGE, 0, 0),
            self._power.zero_targets,
            self._power.disable_voltage,
        )
        if errors:
            errors += _try_all(lambda: self._send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL))
            for other in errors[1:]:
                errors[0].add_note(str(other))
            raise errors[0]

    def reset_fault(self) -> None:
        """Leave FAULT for SWITCH_ON_DISABLED, confirmed by the statusword; forgets the emergency.

        Raises
        ------
        DeviceTimeout
            If the fault does not go away: its cause is still there.
        """
        self._power.reset_fault()
        self._monitor.forget_emergency()
        self._feedback.start_anew()

    def raise_if_faulted(self) -> None:
        """Check the drive's health.

        Raises
        ------
        DeviceFault
            If the drive has sent an EMCY, is in FAULT, or has left NMT OPERATIONAL.
        DeviceTimeout
            If its heartbeat is lost, or never came.
        BusDown, ProtocolViolation
            If the bus is gone, or a frame could not be read.
        """
        self._link.raise_if_failed()
        self._monitor.raise_if_unwell(time.monotonic_ns())
        if self.latest is not None:
            self._power.raise_if_fault(self.latest.state)

    @property
    def _layouts(self) -> tuple[PdoLayout, PdoLayout]:
        return self._rpdo.layout, self._tpdo.layout

    def _command_codec(self) -> PdoCodec:
        codec = self._codec(RPDO_COMMUNICATION, RPDO_MAPPING, _COMMAND_OBJECTS)
        for mapped in codec.layout.objects:
            if mapped.index not in _COMMAND_OBJECTS:
                raise ConfigMismatch(
                    f"EDS {self._eds.path}: the RPDO maps {mapped}, which this program has no value for; expected "
                    "0x6040, 0x6071 and 0x60B2 alone. Take the object out of the mapping in the EDS."
                )
        return codec

    def _codec(self, communication: int, mapping: int, indices: tuple[int, ...]) -> PdoCodec:
        return self._eds.codec(self._eds.pdo_carrying(communication, mapping, *indices), self._where)

    def _subscribe_feedback(self) -> FeedbackReceiver:
        velocity = VelocityScale.from_object(self._eds.default(0x60A9), f"EDS {self._eds.path}")
        receiver = FeedbackReceiver(self._tpdo, self._torque, velocity)
        self._link.subscribe(self._tpdo.layout.cob_id, receiver.on_frame)
        return receiver

    def _subscribe_monitor(self) -> NodeMonitor:
        monitor = NodeMonitor(self._where, self.settings.heartbeat_timeout_ms * 1_000_000)
        self._link.subscribe(HEARTBEAT_COB_ID + self.settings.node_id, monitor.on_heartbeat)
        self._link.subscribe(EMCY_COB_ID + self.settings.node_id, monitor.on_emergency)
        return monitor

    def _start_heartbeats(self) -> None:
        self._link.produce_heartbeat(self.settings.heartbeat_ms / 1000.0)
        consumer = HOST_NODE_ID << 16 | self.settings.heartbeat_timeout_ms
        self._sdo.download_confirmed(0x1016, 1, consumer)
        self._sdo.download_confirmed(0x1017, 0, self.settings.heartbeat_ms)

    def _send_nmt(self, command: NmtCommand) -> None:
        self._link.send(NMT_COB_ID, nmt_frame(command, self.settings.node_id))

    def _send_rpdo(self, command: Command, base: int, prbs: int) -> None:
        values = {0x6040: command.value, 0x6071: base, 0x60B2: prbs}
        data = self._rpdo.pack(tuple(values[mapped.index] for mapped in self._rpdo.layout.objects))
        self._link.send(self._rpdo.layout.cob_id, data)


def _try_all(*steps: Callable[[], None]) -> list[DriverError]:
    """Run every step, also after one has failed; return what failed."""
    errors = []
    for step in steps:
        try:
            step()
        except DriverError as error:
            errors.append(error)
    return errors
