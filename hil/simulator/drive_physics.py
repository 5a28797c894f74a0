"""Inside a simulated drive: torque limits and heat, DC link, sensors, its own clock, its list of errors."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from drivers.canopen.emcy import Emergency
from drivers.capability.carrier import ObjectId
from drivers.capability.speed_unit import SpeedUnit
from drivers.inverter.cia402 import TorqueMode
from drivers.scaling import IntegerType, VelocityScale
from hil.simulator.faults import DriveLimits, InverterFaults

_WARM = 0.9  # where derating begins

SUPPLY_V: Final = 650.0  # a bus's traction battery
UNDER_VOLTAGE_V: Final = 0.7 * SUPPLY_V  # below it the drive goes into fault
DISCHARGE_S: Final = 0.02  # time constant with which a drive under load empties its capacitors [s]

_INT16 = IntegerType.INTEGER16

DRAWN_AT_ONCE = 512

GENERIC: Final = 0x01
_CLASSES: Final = {0x2000: 0x02, 0x3000: 0x04, 0x4000: 0x08, 0x8100: 0x10, 0x8200: 0x10, 0x5000: 0x20, 0x6000: 0x20}
"""Bits of the error register besides the generic one, by class of error code (CiA 301, 7.5.2.2): current, voltage,
temperature, communication, device profile."""

_HISTORY: Final = 4  # entries of the pre-defined error field

_NO_DATA: Final = bytes(5)


@dataclass(frozen=True, slots=True)
class SimulatedInverter:
    """One simulated inverter."""

    node_id: int  # CANopen node id
    rated_torque_nm: float = 600.0  # Motor rated torque; a torque count is 0.1 % of it [Nm]
    supported_modes: frozenset[TorqueMode] = frozenset(TorqueMode)  # Modes of operation it knows; it refuses others
    torque_noise_counts: float = 1.0  # Standard deviation of the torque reading, in counts
    speed_noise_rad_s: float = 0.05  # Standard deviation of the speed reading [rad/s]
    eds_path: Path | None = None  # Its EDS; None for the one that is shipped
    identity: tuple[int, int] = (0, 0)  # Vendor-ID and product code where its EDS has none
    speed_unit: SpeedUnit | None = None  # Unit of its velocity actual value where its EDS has none
    rated_torque_unit_nm: float = 1e-3  # What one count of its object 0x6076 is [Nm]
    # by object, what reads a further channel [counts]
    sensors: Mapping[ObjectId, Callable[[], int]] = field(default_factory=dict)
    faults: InverterFaults = field(default_factory=InverterFaults)  # What is wrong with it
    serial_number: int | None = None  # Entry 4 of its identity, 0x1018; None for the EDS's


class Heat:
    """The temperature of one drive, from cold."""

    def __init__(self, limits: DriveLimits) -> None:
        self._limits = limits
        self._x = 0.0

    @property
    def derating(self) -> bool:
        """Whether it is so warm that the torque is limited."""
        return self._x > _WARM

    def limit_permille(self, maximum_permille: float) -> float:
        """Largest torque at this temperature [per mille of rated]."""
        lowest = min(self._limits.continuous_permille, maximum_permille)
        part = min(max((1.0 - self._x) / (1.0 - _WARM), 0.0), 1.0)
        return lowest + part * (maximum_permille - lowest)

    def pass_time(self, torque_permille: float, duration_s: float) -> None:
        """Let a torque act for a time; exact for a torque that is constant meanwhile."""
        goal = (torque_permille / self._limits.continuous_permille) ** 2
        self._x = goal + (self._x - goal) * math.exp(-duration_s / self._limits.thermal_time_constant_s)


class DcLink:
    """Voltage over simulated time."""

    def __init__(self) -> None:
        self._voltage_v = SUPPLY_V
        self.supplied = True

    @property
    def millivolts(self) -> int:
        """DC link circuit voltage, 0x6079 [mV]."""
        return round(1000.0 * self._voltage_v)

    @property
    def too_low(self) -> bool:
        """Whether the drive can't work with it."""
        return self._voltage_v < UNDER_VOLTAGE_V

    def pass_time(self, duration_s: float) -> None:
        """Let time pass; a supply that is back is back at once."""
        self._voltage_v = SUPPLY_V if self.supplied else self._voltage_v * math.exp(-duration_s / DISCHARGE_S)


class SampleClock:
    """Age of what each SYNC fetches, and the values of that age."""

    def __init__(self, drift_ppm: float) -> None:
        self._drift = drift_ppm * 1e-6
        self._steps = 0
        self._speed_rad_s: float | None = None
        self._torque: float = 0.0

    def sample(self, speed_rad_s: float, torque: float) -> tuple[float, float]:
        """Take speed and torque at this SYNC, return them as sampled.

        Between two SYNCs the speed is taken to change evenly; the torque was that of the SYNC before.
        """
        age = (self._steps * self._drift) % 1.0
        before_rad_s = speed_rad_s if self._speed_rad_s is None else self._speed_rad_s
        sampled_rad_s = speed_rad_s - age * (speed_rad_s - before_rad_s)
        sampled_torque = torque if age == 0.0 else self._torque
        self._steps += 1
        self._speed_rad_s, self._torque = speed_rad_s, torque
        return sampled_rad_s, sampled_torque


def _normal(random: np.random.Generator) -> Iterator[float]:
    """Draw standard normal numbers for ever.

    Many at once: for every array it fills numpy gives the interpreter lock away and takes it back, and a thread that
    waits for the lock would hardly ever get it (see ``estimator.compiled.compiled_with_lock``).
    """
    while True:
        yield from random.standard_normal(DRAWN_AT_ONCE).tolist()


class DriveSensors:
    """The latest readings of one drive."""

    def __init__(self, settings: SimulatedInverter, velocity: VelocityScale, seed: int) -> None:
        self._settings = settings
        self._noise = _normal(np.random.default_rng([seed, settings.node_id]))
        self._velocity_scale = velocity
        self._clock = SampleClock(settings.faults.clock_drift_ppm)
        self.clear()

    def clear(self) -> None:
        """Read nothing yet, as at power-on."""
        self.torque = self.current = self.speed = 0

    def sample(self, true_speed_rad_s: float, torque_permille: float, step: int) -> None:
        """Take what a SYNC finds: true speed [rad/s] and torque [per mille of rated]; ``step`` is its number."""
        speed_rad_s, torque = self._clock.sample(true_speed_rad_s, torque_permille)
        torque_noise, speed_noise = next(self._noise), next(self._noise)
        torque += self._settings.torque_noise_counts * torque_noise
        self.torque = self._converted(torque)
        self.current = self._converted(torque / self._settings.faults.limits.weakening(true_speed_rad_s))
        wrong = self._settings.faults.wrong_speed
        if wrong.stuck_from_step is not None and step >= wrong.stuck_from_step:
            return
        if wrong.gain_from_step is not None and step >= wrong.gain_from_step:
            speed_rad_s *= wrong.gain
        speed_rad_s += self._settings.speed_noise_rad_s * speed_noise
        self.speed = self._velocity_scale.to_raw(speed_rad_s, "simulated resolver")

    def _converted(self, permille: float) -> int:
        """Read as a converter does: in steps, and saturating."""
        return min(max(self._settings.faults.limits.quantised(permille), _INT16.low), _INT16.high)


class ErrorList:
    """What is wrong with one drive now, and what was."""

    def __init__(self) -> None:
        self._active: set[int] = set()
        self._due: list[Emergency] = []
        self._history: deque[int] = deque(maxlen=_HISTORY)

    @property
    def register(self) -> int:
        """Error register, 0x1001, of what is wrong now."""
        bits = 0
        for code in self._active:
            bits |= GENERIC | _CLASSES.get(code & 0xFF00, _CLASSES.get(code & 0xF000, 0))
        return bits

    def set(self, code: int) -> None:
        """Take an error; one that is there already is not reported again."""
        if code not in self._active:
            self._active.add(code)
            self._history.appendleft(code)
            self._due.append(Emergency(code, self.register, _NO_DATA))

    def clear(self, *codes: int) -> None:
        """Take errors for gone, all of them if none is named; the last one's end is reported."""
        before = bool(self._active)
        self._active = self._active.difference(codes) if codes else set()
        if before and not self._active:
            self._due.append(Emergency(0, 0, _NO_DATA))

    def history(self, subindex: int) -> int:
        """Read the pre-defined error field, 0x1003: how many, then the newest first."""
        if subindex == 0:
            return len(self._history)
        return self._history[subindex - 1] if subindex <= len(self._history) else 0

    def forget_history(self) -> None:
        """Empty the pre-defined error field."""
        self._history.clear()

    def take_due(self) -> list[Emergency]:
        """Hand over the EMCY messages not sent yet."""
        due, self._due = self._due, []
        return due
