"""A CiA 402 inverter as a model: objects in, objects out. No bus, no clock, no thread.

Simplifications: the torque follows its command at once (actuator dynamics belong to the plant); stopping of
any kind takes the torque away at once; the torque offset is added in profile torque mode too, unsloped.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drivers.cia402 import (
    AUTOMATIC,
    FAULT_STATES,
    STATUSWORD_STATE_BITS,
    Command,
    PowerState,
    StatusBit,
    TorqueMode,
    command_of,
    next_state,
)
from drivers.emcy import Emergency
from drivers.scaling import IntegerType, TorqueScale, VelocityScale
from hil.simulator.inverter_settings import SimulatedInverter

GENERIC_ERROR = 0x01
"""Bit of the error register, 0x1001."""

VALUE_RANGE_EXCEEDED = 0x06090030
"""SDO abort code."""

PARAMETERS = (0x6071, 0x6072, 0x6087, 0x60B2)
"""Objects that are held as written: target torque, max torque, torque slope, torque offset."""

_INT16 = IntegerType.INTEGER16


class ObjectRefused(Exception):
    """The device does not accept a value; the node answers with an SDO abort.

    Parameters
    ----------
    abort_code
        As in CiA 301, table "SDO abort codes".
    """

    def __init__(self, abort_code: int) -> None:
        self.abort_code = abort_code
        super().__init__(f"SDO abort 0x{abort_code:08X}")


class InverterDevice:
    """One inverter.

    Parameters
    ----------
    settings
        What it is.
    defaults
        Power-on values of the objects in `PARAMETERS` and of 0x60A9, from its EDS.
    seed
        Of its reading noise.
    """

    def __init__(self, settings: SimulatedInverter, defaults: Mapping[int, int], seed: int) -> None:
        self._settings = settings
        self._defaults = defaults
        self._random = np.random.default_rng([seed, settings.node_id])
        self._torque_scale = TorqueScale(settings.rated_torque_nm)
        where = f"simulated inverter, node {settings.node_id}"
        self._velocity_scale = VelocityScale.from_object(defaults[0x60A9], where)
        self._steps = 0
        self.hung = False
        self.reset()

    def reset(self) -> None:
        """Go through power-on: all values at their defaults, state SWITCH_ON_DISABLED or FAULT."""
        self.state = AUTOMATIC[PowerState.NOT_READY_TO_SWITCH_ON]
        self._parameters = {index: self._defaults[index] for index in PARAMETERS}
        self._controlword = 0
        self._mode = 0
        self._error_code = 0
        self._ramp = 0.0
        self._torque = 0
        self._limited = False
        self._torque_reading = 0
        self._speed_reading = 0
        self._emergencies: list[Emergency] = []
        self._meet_faults()

    @property
    def torque_nm(self) -> float:
        """Torque in effect now [Nm]; zero outside OPERATION_ENABLED and when hung."""
        return self._torque_scale.to_nm(self._torque)

    def read(self, index: int, subindex: int = 0) -> int | None:
        """Give the present value of an object the device itself holds; None for any other."""
        faults = self._settings.faults
        if index == 0x1018 and faults.identity is not None and subindex in (1, 2):
            return faults.identity[subindex - 1]
        if index == 0x60A9:
            return faults.velocity_unit
        if index in self._parameters:
            return self._parameters[index]
        return self._reading(index)

    def write(self, index: int, value: int) -> None:
        """Take a new value of an object; one the device does not act on is ignored.

        Raises
        ------
        ObjectRefused
            If the value is not allowed.
        """
        if index == 0x6040:
            self._take_controlword(value)
        elif index == 0x6060:
            self._take_mode(value)
        elif index in self._parameters:
            self._parameters[index] = value

    def step(self, true_speed_rad_s: float, period_s: float) -> None:
        """Take one SYNC: put the commands into effect, sample the readings.

        Parameters
        ----------
        true_speed_rad_s
            Motor speed now [rad/s].
        period_s
            Time until the next SYNC, for the torque slope [s].
        """
        self._steps += 1
        self._meet_faults()
        self._torque = self._torque_in_effect(period_s)
        torque_noise, speed_noise = self._random.standard_normal(2)
        reading = round(self._torque + self._settings.torque_noise_counts * torque_noise)
        self._torque_reading = min(max(reading, _INT16.low), _INT16.high)  # a converter saturates
        speed_rad_s = true_speed_rad_s + self._settings.speed_noise_rad_s * speed_noise
        self._speed_reading = self._velocity_scale.to_raw(speed_rad_s, "simulated resolver")

    def lose_bus(self) -> None:
        """Act on abort connection option code 2 (0x6007): disable voltage."""
        self._take_controlword(Command.DISABLE_VOLTAGE.value)

    def take_emergencies(self) -> list[Emergency]:
        """Hand over the EMCY messages that are due."""
        due, self._emergencies = self._emergencies, []
        return due

    def _meet_faults(self) -> None:
        faults = self._settings.faults
        if faults.hang_at_step == self._steps:
            self.hung = True
            self._torque = 0
        if faults.fault is not None and faults.fault.step == self._steps:
            self._enter_fault(faults.fault.emcy_code)

    def _enter_fault(self, code: int) -> None:
        self._enter(AUTOMATIC[PowerState.FAULT_REACTION_ACTIVE])
        self._error_code = code
        self._emergencies.append(Emergency(code, self._error_register(), bytes(5)))

    def _enter(self, state: PowerState) -> None:
        self.state = state
        if state is not PowerState.OPERATION_ENABLED:
            self._ramp = 0.0
            self._torque = 0
            self._limited = False

    def _take_controlword(self, value: int) -> None:
        command = command_of(value, self._controlword)
        self._controlword = value
        state = next_state(self.state, command)
        if self.state is PowerState.FAULT and state is not PowerState.FAULT:
            self._error_code = 0
            self._emergencies.append(Emergency(0, 0, bytes(5)))
        self._enter(state)

    def _take_mode(self, value: int) -> None:
        if value not in self._settings.supported_modes:
            raise ObjectRefused(VALUE_RANGE_EXCEEDED)
        self._mode = value

    def _torque_in_effect(self, period_s: float) -> int:
        if self.state is not PowerState.OPERATION_ENABLED or self.hung:
            return 0
        target = self._parameters[0x6071]
        if self._mode == TorqueMode.PROFILE_TORQUE:
            step = self._parameters[0x6087] * period_s
            self._ramp += min(max(target - self._ramp, -step), step)
        else:
            self._ramp = target
        wanted = round(self._ramp) + self._parameters[0x60B2]
        limit = self._parameters[0x6072]
        self._limited = abs(wanted) > limit
        return min(max(wanted, -limit), limit)

    def _reading(self, index: int) -> int | None:
        match index:
            case 0x1001:
                return self._error_register()
            case 0x603F:
                return self._error_code
            case 0x6040:
                return self._controlword
            case 0x6041:
                return self._statusword()
            case 0x6061:
                return self._mode
            case 0x606C:
                return self._speed_reading
            case 0x6076:
                return round(self._settings.rated_torque_nm * 1000.0)
            case 0x6077:
                return self._torque_reading
            case 0x6502:
                return sum(mode.support_bit for mode in self._settings.supported_modes)
        return None

    def _statusword(self) -> int:
        limit = StatusBit.INTERNAL_LIMIT_ACTIVE if self._limited else 0
        bits = StatusBit.VOLTAGE_ENABLED | StatusBit.REMOTE | limit
        return STATUSWORD_STATE_BITS[self.state] | bits

    def _error_register(self) -> int:
        return GENERIC_ERROR if self.state in FAULT_STATES else 0
