"""A CiA 402 inverter as a model: objects in, objects out. No bus, no clock, no thread.

Simplifications: the torque follows its command at once (actuator dynamics belong to the plant), but for slopes and
limits; the torque offset is added in profile torque mode too, unsloped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

from drivers.canopen.emcy import Emergency
from drivers.inverter.cia402 import (
    AUTOMATIC,
    FAULT_STATES,
    STATUSWORD_STATE_BITS,
    TORQUE_STATES,
    Command,
    PowerState,
    StatusBit,
    TorqueMode,
    command_of,
    next_state,
)
from drivers.scaling import VelocityScale
from hil.simulator.drive_physics import DcLink, DriveSensors, ErrorList, Heat, SimulatedInverter
from hil.simulator.stopping import KNOWN_CODES, STANDARD_CODES, AbortConnection, Ramp, Stop, halt_ramp, stop_between

VALUE_RANGE_EXCEEDED, VALUE_TOO_HIGH, VALUE_TOO_LOW = 0x06090030, 0x06090031, 0x06090032  # SDO abort codes
TARGETS = (0x6071, 0x60B2)  # target torque and torque offset: neither is taken beyond max torque 0x6072

PARAMETERS: Final[Mapping[int, int]] = {0x6071: 0, 0x6072: 1000, 0x6087: 100_000, 0x60B2: 0, **STANDARD_CODES}
"""Objects that are held as written, with the value of a drive whose EDS lists no such object: target torque, max
torque, torque slope, torque offset, option codes."""

QUICK_SLOPE_PERMILLE_PER_S = 10_000.0  # the drive's own slope for quick stops: rated torque within 100 ms
UNDER_VOLTAGE, LOST_CONNECTION = 0x3220, 0x8100  # error codes of CiA 402 and CiA 301

_HALT = 1 << 8

_REMOTE, _VOLTAGE_ENABLED = StatusBit.REMOTE.value, StatusBit.VOLTAGE_ENABLED.value
_INTERNAL_LIMIT_ACTIVE, _WARNING = StatusBit.INTERNAL_LIMIT_ACTIVE.value, StatusBit.WARNING.value
_FOLLOWS_TARGET = StatusBit.FOLLOWS_TARGET.value  # bits as plain numbers, for one statusword at every SYNC


class ObjectRefused(Exception):
    """The device does not accept a value; the node answers with an SDO abort."""

    def __init__(self, abort_code: int) -> None:
        self.abort_code = abort_code
        super().__init__(f"SDO abort 0x{abort_code:08X}")


class InverterDevice:
    """One inverter."""

    def __init__(
        self, settings: SimulatedInverter, defaults: Mapping[int, int], velocity: VelocityScale, seed: int
    ) -> None:
        self._settings = settings
        self._limits = settings.faults.limits
        self._defaults = defaults
        self._sensors = DriveSensors(settings, velocity, seed)
        self._heat = Heat(self._limits)
        self._dc_link = DcLink()
        self._steps = 0
        self.added_nm = 0.0  # what another controller adds to the reference, past CANopen: the PLC's PRBS
        self._readings = self._reading_of()
        self.hung = False
        self._has_left = False
        self.reset()

    def reset(self) -> None:
        """Go through power-on: all values at their defaults, state SWITCH_ON_DISABLED or FAULT."""
        self.state = AUTOMATIC[PowerState.NOT_READY_TO_SWITCH_ON]
        self._parameters = {index: self._defaults.get(index, value) for index, value in PARAMETERS.items()}
        self._controlword = 0
        self._mode = 0
        self._error_code = 0
        self._stop: Stop | None = None
        self._ramp = 0.0
        self._torque = 0.0
        self._limited = False
        self._follows = False
        self._refused: set[int] = set()
        self._sensors.clear()
        self._errors = ErrorList()
        self._meet_faults()

    @property
    def torque_nm(self) -> float:
        """Torque in effect now [Nm]; zero in every state that carries none, and when hung."""
        return self._torque * self._settings.rated_torque_nm / 1000.0

    def read(self, index: int, subindex: int = 0) -> int | None:
        """Give the present value of an object the device itself holds; None for any other."""
        faults = self._settings.faults
        if index == 0x1018 and faults.identity is not None and subindex in (1, 2):
            return faults.identity[subindex - 1]
        if index == 0x60A9:
            return faults.velocity_unit
        if index == 0x1003:
            return self._errors.history(subindex)
        if index in self._parameters:
            return self._parameters[index]
        reading = self._readings.get(index)
        return None if reading is None else reading()

    def reader(self, index: int) -> Callable[[], int] | None:
        """Give what reads an object that only the device itself can tell, for whoever reads it often; else None."""
        return self._readings.get(index)

    def write(self, index: int, value: int) -> None:
        """Take a new value of an object; one the device does not act on is ignored."""
        if value not in KNOWN_CODES.get(index, (value,)):
            raise ObjectRefused(VALUE_RANGE_EXCEEDED)
        if index == 0x6040:
            self._take_controlword(value)
        elif index == 0x6060:
            self._take_mode(value)
        elif index == 0x1003:
            self._errors.forget_history()
        elif index in TARGETS:
            self._take_target(index, value)
        elif index in self._parameters:
            self._parameters[index] = value

    def _take_target(self, index: int, value: int) -> None:
        """Take a target or offset torque, unless it is beyond max torque 0x6072: then the one before holds."""
        maximum = self._parameters[0x6072]
        if abs(value) > maximum:
            self._refused.add(index)
            raise ObjectRefused(VALUE_TOO_HIGH if value > 0 else VALUE_TOO_LOW)
        self._refused.discard(index)
        self._parameters[index] = value

    def step(self, true_speed_rad_s: float, period_s: float) -> None:
        """Take one SYNC: put the commands into effect, sample the readings."""
        self._steps += 1
        self._meet_faults()
        self._dc_link.pass_time(period_s)
        if self._dc_link.too_low:
            self.fail(UNDER_VOLTAGE)
        self._torque = self._torque_in_effect(true_speed_rad_s, period_s)
        self._heat.pass_time(self._torque, period_s)
        self._sensors.sample(true_speed_rad_s, self._torque, self._steps)

    def lose_connection(self, error_code: int) -> None:
        """Act on the abort connection option code, 0x6007: the host is gone, or has taken the bus away."""
        code = self._parameters[0x6007]
        if code == AbortConnection.FAULT and self.state is not PowerState.SWITCH_ON_DISABLED:
            self.fail(error_code)
        elif code == AbortConnection.DISABLE_VOLTAGE:
            self._take_controlword(Command.DISABLE_VOLTAGE.value)
        elif code == AbortConnection.QUICK_STOP:
            self._take_controlword(Command.QUICK_STOP.value)

    def tell(self, error_code: int) -> None:
        """Take an error that is no fault; it goes out as EMCY."""
        self._errors.set(error_code)

    def recover(self, error_code: int) -> None:
        """Take an error that was no fault for gone."""
        if self.state not in FAULT_STATES:
            self._errors.clear(error_code)

    def fail(self, error_code: int) -> None:
        """Meet a fault: fault reaction as 0x605E has it, then FAULT."""
        self._errors.set(error_code)
        if self.state not in FAULT_STATES:
            self._error_code = error_code
            self._begin(stop_between(self.state, PowerState.FAULT_REACTION_ACTIVE, self._parameters))

    def take_emergencies(self) -> list[Emergency]:
        """Hand over the EMCY messages that are due."""
        return self._errors.take_due()

    def _meet_faults(self) -> None:
        faults = self._settings.faults
        leaves = faults.leaves_operation
        if leaves is not None and not self._has_left and self._steps >= leaves.step:
            if self.state is PowerState.OPERATION_ENABLED:
                self._has_left = True
                self._enter(leaves.what)
        if faults.hang_at_step == self._steps:
            self.hung = True
            self._torque = 0.0
        if faults.brown_out_at_step == self._steps:
            self._dc_link.supplied = False
        if faults.emcy is not None and faults.emcy.step == self._steps:
            self.tell(faults.emcy.what)
        if faults.fault is not None and faults.fault.step == self._steps:
            self.fail(faults.fault.what)

    def _begin(self, stop: Stop) -> None:
        """Stop as ordered; without torque or without a ramp that is over at once."""
        if stop.ramp is Ramp.AT_ONCE or self._torque == 0.0:
            self._enter(stop.final)
        else:
            self.state, self._stop = stop.passing, stop

    def _enter(self, state: PowerState) -> None:
        self.state, self._stop = state, None
        if state is not PowerState.OPERATION_ENABLED:
            self._ramp = 0.0
            self._torque = 0.0
            self._limited = False

    def _take_controlword(self, value: int) -> None:
        command = command_of(value, self._controlword)
        self._controlword = value
        target = next_state(self.state, command)
        if self.state is PowerState.FAULT and target is not self.state:
            self._reset_fault(target)
        elif target is PowerState.OPERATION_ENABLED:
            self._enter(target)
        elif target is not self.state and not self._on_the_way_to(target):
            self._begin(stop_between(self.state, target, self._parameters))

    def _on_the_way_to(self, target: PowerState) -> bool:
        """Whether the ramp of this very command is under way: a command that is repeated does not begin it anew."""
        return self._stop is not None and self._stop.final is target and self.state is PowerState.OPERATION_ENABLED

    def _reset_fault(self, target: PowerState) -> None:
        if not self._dc_link.too_low:  # the cause is still there
            self._error_code = 0
            self._errors.clear()
            self._enter(target)

    def _take_mode(self, value: int) -> None:
        if value not in self._modes:
            raise ObjectRefused(VALUE_RANGE_EXCEEDED)
        self._mode = value

    def _torque_in_effect(self, speed_rad_s: float, period_s: float) -> float:
        self._follows = False
        if self.hung or self.state not in TORQUE_STATES:
            return 0.0
        if self._stop is not None:
            return self._stopping(self._stop, period_s)
        if self.state is not PowerState.OPERATION_ENABLED:
            return 0.0
        if self._controlword & _HALT:
            self._ramp = self._halting(halt_ramp(self._parameters), period_s)
            return self._ramp
        if self._ignores_target:
            return 0.0
        if self._mode == TorqueMode.PROFILE_TORQUE:
            self._ramp = _towards(self._parameters[0x6071], self._ramp, self._slope(Ramp.SLOPE) * period_s)
        else:
            self._ramp = self._parameters[0x6071]
            self._follows = True
        added = round(self.added_nm * 1000.0 / self._settings.rated_torque_nm)
        wanted = self._within_limits(round(self._ramp) + self._parameters[0x60B2] + added, speed_rad_s)
        return self._settings.faults.wrong_torque.given(wanted, self._steps)

    @property
    def _ignores_target(self) -> bool:
        since = self._settings.faults.ignores_target_from_step
        return since is not None and self._steps >= since

    def _stopping(self, stop: Stop, period_s: float) -> float:
        torque = self._ramp = _towards(0.0, self._torque, self._slope(stop.ramp) * period_s)
        if torque == 0.0:
            self._enter(stop.final)
        return torque

    def _halting(self, ramp: Ramp, period_s: float) -> float:
        return 0.0 if ramp is Ramp.AT_ONCE else _towards(0.0, self._torque, self._slope(ramp) * period_s)

    def _slope(self, ramp: Ramp) -> float:
        """Steepness [per mille of rated torque per second]; a slope of 0 is none, so that the torque steps."""
        return QUICK_SLOPE_PERMILLE_PER_S if ramp is Ramp.QUICK else float(self._parameters[0x6087]) or math.inf

    def _within_limits(self, wanted: int, speed_rad_s: float) -> float:
        maximum = self._heat.limit_permille(self._parameters[0x6072]) * self._limits.weakening(speed_rad_s)
        self._limited = abs(wanted) > maximum
        return min(max(float(wanted), -maximum), maximum)

    def _reading_of(self) -> dict[int, Callable[[], int]]:
        """List the objects that only the device itself can tell."""
        return {
            0x1001: lambda: self._errors.register,
            0x603F: lambda: self._error_code,
            0x6040: lambda: self._controlword,
            0x6041: self._statusword,
            0x6061: lambda: self._mode,
            0x606C: lambda: self._sensors.speed,
            0x6076: lambda: round(self._settings.rated_torque_nm / self._settings.rated_torque_unit_nm),
            0x6077: lambda: self._sensors.torque,
            0x6078: lambda: self._sensors.current,
            0x6079: lambda: self._dc_link.millivolts,
            0x6502: self._supported_modes,
        }

    @property
    def _modes(self) -> frozenset[TorqueMode]:
        """Torque modes it takes: those its EDS lists, or all it knows if that lists none."""
        listed = frozenset(mode for mode in TorqueMode if self._defaults.get(0x6502, 0) & mode.support_bit)
        return self._settings.supported_modes & (listed or self._settings.supported_modes)

    def _supported_modes(self) -> int:
        torque_modes = sum(mode.support_bit for mode in TorqueMode)
        described = self._defaults.get(0x6502)
        if described and not described & torque_modes:
            return described  # it says less than it can do
        return (described or 0) & ~torque_modes | sum(mode.support_bit for mode in self._modes)

    def _statusword(self) -> int:
        bits = STATUSWORD_STATE_BITS[self.state] | _REMOTE
        if not self._dc_link.too_low:
            bits |= _VOLTAGE_ENABLED
        if self._limited or self._refused:
            bits |= _INTERNAL_LIMIT_ACTIVE
        if self._heat.derating:
            bits |= _WARNING
        if self._follows and self.state is PowerState.OPERATION_ENABLED:
            bits |= _FOLLOWS_TARGET
        return bits


def _towards(goal: float, value: float, most: float) -> float:
    """Move a value towards a goal by at most so much."""
    return value + min(max(goal - value, -most), most)
