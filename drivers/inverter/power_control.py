"""Mode and power state of one drive, changed over SDO and confirmed by what the drive then reports."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

from drivers.canopen.emcy import cause_of
from drivers.canopen.sdo import SdoChannel
from drivers.errors import ConfigMismatch, DeviceFault, DeviceTimeout, ForeignController, ProtocolViolation
from drivers.inverter.cia402 import (
    FAULT_STATES,
    TORQUE_STATES,
    TOWARDS_OPERATION,
    Command,
    PowerState,
    next_state,
    state_of,
)
from drivers.inverter.settings import InverterSettings

T = TypeVar("T")

_POLL_PAUSE_S = 0.002
"""Between two reads of an object that has not followed yet; drives update these about once a ms."""


_NO_TORQUE_PERMILLE = 10  # what counts as no torque: a reading at standstill is noisy [per mille of rated]


class PowerControl:
    """Walks one drive through the CiA 402 state machine."""

    def __init__(
        self,
        sdo: SdoChannel,
        settings: InverterSettings,
        torque_objects: tuple[int, ...],
        last_error: Callable[[], int | None],
    ) -> None:
        self._sdo = sdo
        self._settings = settings
        self._torque_objects = torque_objects
        self._last_error = last_error
        self._where = settings.where

    def select_mode(self) -> None:
        """Write 0x6060 and wait for 0x6061 to agree."""
        mode, timeout_s = self._settings.mode, self._settings.mode_timeout_s
        try:
            self._sdo.download(0x6060, 0, mode)
        except ConfigMismatch as error:
            raise ConfigMismatch(
                f"{self._where}: mode of operation {mode.title} refused, it stays at "
                f"{self._sdo.upload(0x6061)}. Check object 0x6502 for supported modes. ({error})"
            ) from error
        display = self._poll(lambda: self._sdo.upload(0x6061), lambda shown: shown == mode, timeout_s)
        if display != mode:
            raise DeviceTimeout(
                f"{self._where}: mode of operation is {display} after {timeout_s:g} s, expected "
                f"{mode.title}. "
                "Check object 0x6502 for supported modes."
            )

    def zero_targets(self) -> None:
        """Write zero to target torque and, where there is one, torque offset."""
        for index in self._torque_objects:
            self._sdo.download(index, 0, 0)

    def enable_operation(self) -> None:
        """Step to OPERATION_ENABLED; the torque is what the targets say."""
        state = self._await(lambda state: state is not PowerState.NOT_READY_TO_SWITCH_ON, "to initialise")
        while state is not PowerState.OPERATION_ENABLED:
            self.raise_if_fault(state)
            state = self._step(state, TOWARDS_OPERATION[state])

    def make_ready(self) -> None:
        """Step to READY_TO_SWITCH_ON, where the power stage is off, from whatever state."""
        self.disable_voltage()
        state = self._await(lambda state: state not in TORQUE_STATES, "without torque")
        self.raise_if_fault(state)
        self._step(PowerState.SWITCH_ON_DISABLED, Command.SHUTDOWN)

    def quick_stop(self, sync: Callable[[], object]) -> None:
        """Take the torque away as the quick stop option code 0x605A has it, and wait for the end of it.

        Which state that is the code says: SWITCH_ON_DISABLED, or QUICK_STOP_ACTIVE at no torque (5 to 8).
        """
        self._command(Command.QUICK_STOP)
        self._await(lambda state: state is not PowerState.OPERATION_ENABLED, "out of operation")

        def torque_permille() -> int:
            sync()
            return self._sdo.upload(0x6077)

        timeout_s = self._settings.state_timeout_s
        torque = self._poll(torque_permille, lambda permille: abs(permille) <= _NO_TORQUE_PERMILLE, timeout_s)
        state = self.state()
        if abs(torque) > _NO_TORQUE_PERMILLE and state in TORQUE_STATES:
            raise DeviceTimeout(
                f"{self._where}: torque actual value 0x6077 is {torque / 10:g} % of rated "
                f"{timeout_s:g} s after a quick stop, in {state.value}, expected none. Compare "
                "the quick stop option code 0x605A and the slope it names with the drive's manual."
            )

    def disable_voltage(self) -> None:
        """Take the voltage off, from whatever state."""
        self._command(Command.DISABLE_VOLTAGE)
        self._await(lambda state: state not in TORQUE_STATES, "without torque")

    def reset_fault(self) -> None:
        """Give the rising edge of fault reset and wait for FAULT to end."""
        self._command(Command.DISABLE_VOLTAGE)  # the edge needs a zero before it
        self._command(Command.FAULT_RESET)
        self._await(lambda state: state not in FAULT_STATES, "without fault")
        self._command(Command.DISABLE_VOLTAGE)

    def _step(self, state: PowerState, command: Command) -> PowerState:
        target = next_state(state, command)
        self._command(command)
        return self._await(lambda state: state is target or state in FAULT_STATES, target.value)

    def _command(self, command: Command) -> None:
        self._sdo.download(0x6040, 0, command.value)

    def state(self) -> PowerState:
        """Power state, read by SDO."""
        return state_of(self._sdo.upload(0x6041))

    def _await(self, accept: Callable[[PowerState], bool], expected: str) -> PowerState:
        state = self._poll(self.state, accept, self._settings.state_timeout_s)
        if not accept(state):
            raise DeviceTimeout(
                f"{self._where}: power state is {state.value} after {self._settings.state_timeout_s:g} s, "
                f"expected {expected}. Check enable inputs, mains contactor and interlocks of the drive."
            )
        return state

    def require_disabled(self) -> None:
        """Refuse a drive that is enabled before it is configured: an NMT command would take its torque from it.

        One that does not say, as in NMT STOPPED, has no torque to lose.
        """
        with suppress(DeviceTimeout, ProtocolViolation):
            if self.state() is PowerState.OPERATION_ENABLED:
                raise ForeignController(
                    f"{self._where}: power state is {PowerState.OPERATION_ENABLED.value} before it is configured, "
                    "expected a drive that is disabled. Another host drives it: end that one first."
                )

    def raise_if_fault(self, state: PowerState) -> None:
        """Refuse a fault state, with the cause the drive gives in its error code 0x603F, or in its EMCY without one."""
        if state in FAULT_STATES:
            raise DeviceFault(f"{self._where}: {self._fault_of(state)}")

    def reacts_to_a_lost_host(self) -> bool:
        """Whether the drive says what it does without its host: by an abort connection option code other than 0."""
        return self._sdo.has(0x6007) and self._sdo.upload(0x6007) != 0

    def fault(self) -> str | None:
        """Read whether the drive is in a fault state: state, cause and cure in words, or None. Nothing is written."""
        state = self.state()
        return self._fault_of(state) if state in FAULT_STATES else None

    def _fault_of(self, state: PowerState) -> str:
        return (
            f"power state is {state.value}, {self._cause()}, expected a drive without fault. Fix the cause at the "
            "drive, reset the fault."
        )

    def _cause(self) -> str:
        if self._sdo.has(0x603F):
            code = self._sdo.upload(0x603F)
            return f"error code 0x603F is 0x{code:04X} {cause_of(code)}"
        emergency = self._last_error()
        if emergency is None:
            return "cause unknown (no 0x603F in the drive, no EMCY since this program began)"
        return f"error code of its EMCY is 0x{emergency:04X} {cause_of(emergency)}"

    def _poll(self, read: Callable[[], T], accept: Callable[[T], bool], timeout_s: float) -> T:
        """Read until accepted or out of time; the last value either way."""
        deadline = time.monotonic() + timeout_s
        while not accept(value := read()) and time.monotonic() < deadline:
            time.sleep(_POLL_PAUSE_S)
        return value
