"""A traction inverter on CANopen: CiA 402 torque modes, driven by SYNC.

Order of use: ``check`` (reads only), ``configure``, ``arm``, then in each cycle ``command``, `CanLink.sync`,
``await_feedback``, ``raise_if_faulted``; at the end, always, ``disarm``. Arming and disarming go by SDO and
are confirmed object by object; ``canopen``'s own CiA 402 node is not used, for its mode setter reports
success when the drive has not followed.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from drivers.canopen.can_link import CanLink
from drivers.canopen.heartbeat import HEARTBEAT_COB_ID, NMT_COB_ID, NmtCommand, NmtState, nmt_frame
from drivers.canopen.node_monitor import NodeMonitor
from drivers.errors import CommandRefused, ConfigMismatch, DeviceFault, DriverError
from drivers.inverter.check import Difference, fixed_differences
from drivers.inverter.cia402 import Command, PowerState, TorqueMode
from drivers.inverter.drive_settings import TORQUE_SLOPE, emcy_cob_id
from drivers.inverter.drive_supervision import left_operation
from drivers.inverter.feedback import InverterFeedback
from drivers.inverter.inspection import InspectedInverter
from drivers.inverter.pdos import TARGET_TORQUE, TORQUE_OFFSET, TorqueCounts, set_up_pdos
from drivers.inverter.power_control import PowerControl
from drivers.inverter.settings import InverterSettings
from drivers.inverter.stop_proof import StopProof
from drivers.torque_guard import GuardedTorque

__all__ = ["Difference", "Inverter", "InverterFeedback", "InverterSettings"]

NO_TORQUE: Final = TorqueCounts()

SDO_REQUEST_COB_ID: Final = 0x600  # plus the node id


class Inverter(InspectedInverter):
    """One inverter on a link: what its set-up reads (`InspectedInverter`), and what commands it.

    Parameters
    ----------
    link
        The bus it is on.
    settings
        What the rig file says of it.

    Raises
    ------
    ConfigMismatch
        As `InspectedInverter`.
    """

    def __init__(self, link: CanLink, settings: InverterSettings) -> None:
        super().__init__(link, settings)
        self._feedback = self._pdos.receiver()
        self._channels = self._pdos.channel_receiver()
        for cob_id, take in (*self._feedback.subscriptions, *self._channels.subscriptions):
            link.subscribe(cob_id, take)
        self._monitor = NodeMonitor(settings.where, settings.heartbeat_timeout_ms * 1_000_000)
        link.subscribe(HEARTBEAT_COB_ID + settings.node_id, self._monitor.on_heartbeat)
        link.subscribe(emcy_cob_id(self._plan), self._monitor.on_emergency)
        for cob_id in self._pdos.rpdos:
            link.pdos_to_disable.claim(cob_id, f"{settings.where}: an RPDO")
        link.pdos_to_disable.claim(SDO_REQUEST_COB_ID + settings.node_id, f"{settings.where}: an SDO request")
        self._power = PowerControl(self._sdo, settings, self._torque_objects(), self._error_code)
        self._before_arming: InverterFeedback | None = None
        self._armed = False
        self.dead_cycles: int | None = None  # of the last `prove_stop`; None where it was not measured

    @property
    def latest(self) -> InverterFeedback | None:
        """The last feedback received; None before the first after `configure`."""
        return self._feedback.latest

    @property
    def has_offset(self) -> bool:
        """Whether the PRBS goes into the torque offset, which no torque slope holds."""
        return self._pdos.has_offset

    @property
    def is_armed(self) -> bool:
        """Whether this program commands it: its power stage may be on."""
        return self._armed

    def messages(self) -> tuple[int, int]:
        """How often the seldomest and the commonest kind of its TPDOs has come since this was last asked."""
        return self._feedback.messages()

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

    def wake(self) -> None:
        """Bring the node to where it answers SDO requests, whatever state another host has left it in.

        Raises
        ------
        ForeignController
            If the drive is enabled, which this program has not done.
        """
        self._monitor.expect(None)
        self._power.require_disabled()
        self._send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL)

    def configure(self) -> None:
        """Give the device its PDO layout, option codes and what it watches the host by; start NMT operation.

        Every write is read back; NMT OPERATIONAL is confirmed by the node's heartbeat.

        Raises
        ------
        ConfigMismatch
            If identity, rated torque, scale, limit or modes differ, or a write does not hold.
        DeviceTimeout
            If the node does not answer or does not become operational.
        ForeignController
            If the drive is enabled, which this program has not done.
        """
        self._armed = False
        self._monitor.expect(None)
        self._power.require_disabled()
        self._send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        if differences := tuple(fixed_differences(self._sdo, self._plan, self.settings)):
            raise ConfigMismatch(
                f"{'; '.join(map(str, differences))}. Correct the rig file, or connect the drive it describes."
            )
        set_up_pdos(self._sdo, self._plan, self._where)
        # before the drive listens for it:
        self._link.produce_heartbeat(self.settings.host_heartbeat_s, self.settings.host_node_id)
        for setting in self._given:
            if not (setting.at_most and setting.is_met_by(self._sdo.upload(setting.index, setting.subindex))):
                self._sdo.download_confirmed(setting.index, setting.subindex, setting.value)
        self._link.beat()  # the drive watches its host from now on, and not from some later heartbeat
        self._feedback.start_anew()
        self._channels.start_anew()
        self._monitor.forget_lost_host()
        self._monitor.await_state(
            NmtState.OPERATIONAL, self.settings.nmt_timeout_s, ask=lambda: self._send_nmt(NmtCommand.START)
        )
        self._monitor.expect(NmtState.OPERATIONAL)
        self.settings = replace(self.settings, torque_slope_nm_per_s=self._slope_in_effect())

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
        self._before_arming = self.latest
        self._feedback.messages()
        self._armed = True

    def command(self, torque: GuardedTorque) -> None:
        """Send the command; the drive puts it into effect at the next SYNC.

        Raises
        ------
        CommandRefused
            If the drive is not armed, or the torque does not fit its object.
        DeviceFault
            If it has left OPERATION ENABLED since: the command would enable it again.
        BusDown
            If the bus is gone.
        """
        if not self._armed:
            raise CommandRefused(
                f"{self._where}: {torque.base_nm} Nm commanded while disarmed, expected arm() before. Nothing was sent."
            )
        latest = self.latest
        if latest is not None and latest.state is not PowerState.OPERATION_ENABLED:
            self._refuse_to_enable(latest)
        self._send_command(Command.ENABLE_OPERATION, self._pdos.counts(torque))

    def _refuse_to_enable(self, latest: InverterFeedback) -> None:
        if latest is not self._before_arming:
            self._power.raise_if_fault(latest.state)
            raise DeviceFault(left_operation(self._where, latest.state))

    def await_feedback(self, after_ns: int, timeout_s: float) -> InverterFeedback | None:
        """Wait for the TPDOs received after ``after_ns``, the result of `CanLink.sync` [ns].

        Returns
        -------
        InverterFeedback or None
            None if none came in ``timeout_s``.
        """
        return self._feedback.await_after(after_ns, timeout_s)

    def await_channels(self, after_ns: int, timeout_s: float) -> tuple[int | None, ...]:
        """Wait for the further objects to be recorded that were received after ``after_ns`` [ns].

        Returns
        -------
        tuple of int or None
            The count of each of ``settings.channels``; None for one that did not come in ``timeout_s``.
        """
        return self._channels.await_after(after_ns, timeout_s)

    def quick_stop(self) -> None:
        """Stop as the quick stop option code 0x605A has it, confirmed by statusword and torque actual value.

        A ramp of a second takes a second; `disarm` takes the torque away at once. The drive is disarmed after it.

        Raises
        ------
        DeviceTimeout
            If the drive does not follow.
        """
        self._armed = False
        self._send_command(Command.QUICK_STOP)  # overwrites the RPDO still waiting for SYNC
        self._power.quick_stop(self._continue_stopping)

    def _continue_stopping(self) -> None:
        """Repeat the command with every SYNC, or the drive would take the host for dead before its ramp is over."""
        self._send_command(Command.QUICK_STOP)
        self._link.sync()

    def prove_stop(self, period_s: float) -> tuple[Difference, ...]:
        """Let the host play dead and see that the drive notices: commands no torque, leaves the drive disabled.

        Configures the drive as for a run, and brings it to READY TO SWITCH ON, with the power stage off.

        Parameters
        ----------
        period_s
            Time between two SYNCs [s].

        Returns
        -------
        tuple of Difference
            Empty if it is proved.

        Raises
        ------
        DriverError
            If the drive can't be configured or made ready.
        """
        proof = StopProof(
            self._link,
            self.settings,
            self._power,
            self._monitor,
            self.configure,
            self._send_command,
            self._await_state,
        )
        differences = tuple(proof.run(self._given, period_s))
        self._proof, self.dead_cycles = proof.seen, proof.dead_cycles
        return differences

    def _await_state(self, after_ns: int, timeout_s: float) -> PowerState | None:
        feedback = self.await_feedback(after_ns, timeout_s)
        return None if feedback is None else feedback.state

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
            lambda: self._send_command(Command.DISABLE_VOLTAGE),
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
        """Check the bus and the drive's own word: EMCY, heartbeat, NMT state, fault state.

        Raises
        ------
        DeviceFault
            If the drive has sent an EMCY, is in FAULT, or has left NMT OPERATIONAL, be it for a moment.
        DeviceTimeout
            If its heartbeat is lost, or never came.
        BusDown, ProtocolViolation
            If the bus is gone, or a frame could not be read.
        ForeignController
            If somebody else commands the drives, while the link is watched for that.
        """
        self._link.raise_if_failed()
        self._link.pdos_to_disable.raise_if_seen()
        self._monitor.raise_if_unwell(time.monotonic_ns())
        latest = self.latest
        if latest is not None:
            self._power.raise_if_fault(latest.state)

    def _slope_in_effect(self) -> float | None:
        """Give the torque slope of profile torque mode, the drive's own where none is given; None without one."""
        given, entry = self.settings.torque_slope_nm_per_s, self._plan.sheet.entry(TORQUE_SLOPE)
        if given is not None or self.settings.mode is not TorqueMode.PROFILE_TORQUE:
            return given
        if entry is None or not entry.readable:
            return None
        permille_per_s = self._sdo.upload(TORQUE_SLOPE)
        return permille_per_s * self.settings.rated_torque_nm / 1000.0 or None

    def _error_code(self) -> int | None:
        """Give the error code of the drive's last EMCY; None if it sent none."""
        emergency = self._monitor.emergency
        return None if emergency is None else emergency.code

    def _torque_objects(self) -> tuple[int, ...]:
        """List what has to be zero for no torque to be asked for: also an offset that no PDO carries."""
        offset = self._plan.sheet.entry(TORQUE_OFFSET)
        there = offset is not None and offset.writable and (TORQUE_OFFSET, 0) in self._pdos.eds.types()
        return (TARGET_TORQUE, TORQUE_OFFSET) if there else (TARGET_TORQUE,)

    def _send_nmt(self, command: NmtCommand) -> None:
        self._link.send(NMT_COB_ID, nmt_frame(command, self.settings.node_id))

    def _send_command(self, command: Command, counts: TorqueCounts = NO_TORQUE) -> None:
        for cob_id, data in self._pdos.frames(command, counts):
            self._link.send(cob_id, data)


def _try_all(*steps: Callable[[], None]) -> list[DriverError]:
    """Run every step, also after one has failed; return what failed."""
    errors = []
    for step in steps:
        try:
            step()
        except DriverError as error:
            errors.append(error)
    return errors
