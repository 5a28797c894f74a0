"""Proof that a dead host means zero torque, without commanding any.

The drive is configured as for a run and brought to READY TO SWITCH ON: its power stage is off, and no command leads
to torque. Then the host plays dead, once by its commands, once by its heartbeat. A drive that watches its host says
so by EMCY, and leaves READY TO SWITCH ON as its abort connection option code 0x6007 has it: the same reaction that
takes the torque away in a run. What it would do with a torque is not seen; that much is its maker's word.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from drivers.canopen.can_link import CanLink
from drivers.canopen.node_monitor import NodeMonitor
from drivers.errors import DeviceFault
from drivers.inverter.check import Difference
from drivers.inverter.cia402 import FAULT_STATES, TORQUE_STATES, PowerState
from drivers.inverter.drive_settings import RPDO_EVENT_TIMER, DriveSetting
from drivers.inverter.power_control import PowerControl
from drivers.inverter.settings import InverterSettings

SOURCE = "proof"
"""Where the expectations come from, in the differences found."""

PATIENCE_S = 0.5
"""How much later than promised a drive may say that its host is gone [s]: neither end is a real-time system."""

CONNECTION_LOST = (0x8100, 0x8200)
"""Error classes of CiA 301 that say so: communication, protocol."""


class StopProof:
    """The host of one drive, playing dead.

    Parameters
    ----------
    link
        The bus.
    settings
        Times and name of the drive.
    power, monitor
        Its power state, and what it says of itself.
    configure
        Configures it, as for a run.
    send_ready
        Sends its RPDO with the command that keeps READY TO SWITCH ON, and no torque.
    """

    def __init__(
        self,
        link: CanLink,
        settings: InverterSettings,
        power: PowerControl,
        monitor: NodeMonitor,
        configure: Callable[[], None],
        send_ready: Callable[[], None],
    ) -> None:
        self._link = link
        self._settings = settings
        self._power = power
        self._monitor = monitor
        self._configure = configure
        self._send_ready = send_ready

    def run(self, given: tuple[DriveSetting, ...], period_s: float) -> Iterator[Difference]:
        """Play dead in both ways; the drive is disabled at the end.

        Parameters
        ----------
        given
            What the drive was configured with.
        period_s
            Time between two SYNCs [s].

        Raises
        ------
        DriverError
            If the drive can't be configured or made ready, answers no more, or is in operation: then another
            program drives it.
        """
        self._refuse_if_driven()
        try:
            yield from self._without_commands(given, period_s)
            self._revive()
            yield from self._without_heartbeat()
            self._revive()
        finally:
            self._link.stop_heartbeat()
            self._power.disable_voltage()

    def _refuse_if_driven(self) -> None:
        state = self._power.state()
        if state in TORQUE_STATES:
            raise DeviceFault(
                f"{self._settings.where}: power state is {state.value}, expected a drive that is disabled: another "
                "program drives it, and this proof would take its torque away. End that program first."
            )

    def _without_commands(self, given: tuple[DriveSetting, ...], period_s: float) -> Iterator[Difference]:
        timers = [setting for setting in given if setting.subindex == RPDO_EVENT_TIMER and setting.watches_host]
        if not timers:
            yield Difference(
                self._settings.where,
                "stop without commands",
                "an RPDO with an event timer (deadline monitoring)",
                "none in the EDS: a host whose cycle hangs and whose heart beats is not noticed",
                SOURCE,
            )
            return
        self._make_ready()
        self._send_ready()
        self._link.sync()
        yield from self._noticed("stop without commands", timers[0].value, lambda: self._sync_and_wait(period_s))

    def _without_heartbeat(self) -> Iterator[Difference]:
        self._make_ready()
        self._link.stop_heartbeat()
        yield from self._noticed("stop without heartbeat", self._settings.heartbeat_timeout_ms, _wait)

    def _revive(self) -> None:
        """Come back to life; a fault that playing dead has made, 0x6007 being 1, is reset."""
        self._link.produce_heartbeat(self._settings.heartbeat_ms / 1000.0)
        if self._power.state() in FAULT_STATES:
            self._power.reset_fault()

    def _make_ready(self) -> None:
        self._configure()
        self._power.make_ready()
        self._monitor.forget_emergency()

    def _noticed(self, what: str, within_ms: int, pause: Callable[[], None]) -> Iterator[Difference]:
        deadline_s = time.monotonic() + within_ms / 1000.0 + PATIENCE_S
        while not self._complained() and time.monotonic() < deadline_s:
            pause()
        state = self._power.state()
        if not self._complained() or state is PowerState.READY_TO_SWITCH_ON:
            emergency = self._monitor.emergency
            yield Difference(
                self._settings.where,
                what,
                f"an EMCY 0x81xx or 0x82xx within {within_ms} ms, and READY TO SWITCH ON left",
                f"{emergency or 'no EMCY'}, power state {state.value}",
                SOURCE,
            )

    def _complained(self) -> bool:
        emergency = self._monitor.emergency
        return emergency is not None and emergency.code & 0xFF00 in CONNECTION_LOST

    def _sync_and_wait(self, period_s: float) -> None:
        self._link.sync()
        time.sleep(period_s)


def _wait() -> None:
    time.sleep(0.01)
