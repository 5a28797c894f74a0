"""A simulated drive PLC: what its program does, in simulated time; nothing of registers, sockets or clocks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from threading import Lock
from types import MappingProxyType
from typing import Final

from drivers.plc.register import Value
from drivers.plc.types import ClutchState, DriveMode, PrbsSource
from hil.simulator.faults import PlcAnswers, PlcFaults

CELLS: Final = 10
TAPS: Final = (10, 7)

IDENTITY: Final = MappingProxyType({"vendor_code": 0x00484944, "device_code": 0x2024, "map_version": 1})
"""What this PLC identifies as; the shipped map expects the same, which a test sees to."""

COUNTS: Final = 65536  # the PLC's watchdog starts over here: it is a 16-bit register
ROUNDING_CYCLES: Final = 1e-6  # part of a PLC cycle by which sums of steps may fall short of a whole one


class PlcPrbs:
    """The generator, clocked by the PLC's cycle."""

    def __init__(self, amplitude_nm: float, divider: int, seed: int) -> None:
        self._amplitude_nm = amplitude_nm
        self._divider = divider
        self._state = seed
        self._held = 0

    @property
    def torque_nm(self) -> float:
        """Level of this cycle [Nm]; its sign is that of the last cell."""
        return self._amplitude_nm if self._state >> (CELLS - 1) else -self._amplitude_nm

    def clock(self) -> None:
        """Let one PLC cycle pass."""
        self._held += 1
        if self._held >= self._divider:
            feedback = sum(self._state >> (cell - 1) for cell in TAPS) & 1
            self._state = ((self._state << 1) | feedback) & (2**CELLS - 1)
            self._held = 0


class ValueRefusedError(ValueError):
    """The PLC's program does not accept what the host writes; the server answers with an exception code."""


@dataclass(frozen=True, slots=True)
class PlcSetup:
    """How the PLC is built, and what it starts with."""

    drive_mode: DriveMode = DriveMode.SERIES  # Mode at the start
    speed_limit_rad_s: float = 320.0  # largest motor speed it reports [rad/s]
    torque_limit_nm: float = 450.0  # largest torque of one inverter it reports [Nm]
    period_s: float = 0.01  # PLC cycle [s]
    host_timeout_s: float = math.inf  # simulated time without the host's beat after which it permits no torque


_ACCEPTED: Final[Mapping[str, tuple[str, Callable[[Value], bool]]]] = MappingProxyType(
    {
        "host_count": ("a count", lambda value: True),
        "drive_mode_request": ("a drive mode", lambda value: value in [mode.value for mode in DriveMode]),
        "prbs_enable": ("on or off", lambda value: True),
        "prbs_amplitude": ("0 Nm or more", lambda value: float(value) >= 0.0),
        "prbs_divider": ("1 or more", lambda value: int(value) >= 1),
        "prbs_seed": (f"1 to {2**CELLS - 1}", lambda value: 1 <= int(value) < 2**CELLS),
        "prbs_source": ("a source", lambda value: value in [source.value for source in PrbsSource]),
    }
)
"""Registers the host may write: what the program accepts in each."""


class PlcDevice:
    """The PLC's program."""

    def __init__(self, setup: PlcSetup | None = None, faults: PlcFaults | None = None) -> None:
        self._setup = setup or PlcSetup()
        self._faults = faults or PlcFaults()
        self._lock = Lock()
        self._time_s = 0.0
        self._cycles = 0
        self._seen_s = math.inf  # no beat yet
        self._drive_mode = self._setup.drive_mode
        self._clutch = _clutch_in(self._drive_mode)
        self._permissive = True
        self._prbs: PlcPrbs | None = None
        self._sensed: dict[str, Value] = {}
        self._held: dict[str, Value] = {
            "host_count": 0,
            "drive_mode_request": self._drive_mode.value,
            "prbs_enable": False,
            "prbs_amplitude": 0.0,
            "prbs_divider": 1,
            "prbs_seed": 1,
            "prbs_source": PrbsSource.HOST.value,
        }
        self._fail()

    @property
    def clutch(self) -> ClutchState:
        """The coupling between engine and motor shaft, for the driveline simulation."""
        with self._lock:
            return self._clutch

    @property
    def prbs_torque_nm(self) -> float:
        """Output of the PLC's own generator, both inverters together [Nm]; 0 while it does not run."""
        with self._lock:
            return self._prbs_nm()

    @property
    def answers(self) -> PlcAnswers:
        """How the PLC answers now; for whoever serves it."""
        with self._lock:
            return self._faults.answers(self._time_s)

    @property
    def swaps_floats(self) -> bool:
        """Whether its floating-point values have their words in another order than the register map says."""
        return self._faults.swaps_floats

    def step(self, dt_s: float) -> None:
        """Let simulated time pass [s]; the PLC cycles that end in it run."""
        with self._lock:
            self._time_s += dt_s
            whole_cycles = math.floor(self._time_s / self._setup.period_s + ROUNDING_CYCLES)
            for _ in range(whole_cycles - self._cycles):
                self._cycle()
            self._fail()

    def show(self, sensed: Mapping[str, Value]) -> None:
        """Take what further sensors read now, by register name."""
        with self._lock:
            self._sensed = dict(sensed)

    def values(self) -> dict[str, Value]:
        """Take a snapshot of everything the PLC shows, by register name."""
        with self._lock:
            return {
                **self._sensed,
                **IDENTITY,
                **self._held,
                "permissive": self._permits(),
                "drive_mode": self._drive_mode.value,
                "clutch": self._clutch.value,
                "speed_limit": self._setup.speed_limit_rad_s,
                "torque_limit": self._setup.torque_limit_nm,
                "plc_count": self._cycles % COUNTS,
                "host_count_seen": self._held["host_count"],
                "prbs_torque": self._prbs_nm(),
            }

    def write(self, values: Mapping[str, Value]) -> None:
        """Take what the host writes, by register name: all of it or nothing."""
        for name, value in values.items():
            expected, accepts = _ACCEPTED.get(name, ("no write: this register is read only", _nothing))
            if not accepts(value):
                raise ValueRefusedError(f"PLC register {name}: expected {expected}, got {value!r}.")
        with self._lock:
            self._held.update(values)
            self._react(values)

    def _react(self, values: Mapping[str, Value]) -> None:
        if "host_count" in values:
            self._seen_s = self._time_s
        if "drive_mode_request" in values:
            self._drive_mode = DriveMode(values["drive_mode_request"])
            self._clutch = _clutch_in(self._drive_mode)
        if any(name.startswith("prbs_") for name in values):
            runs = self._held["prbs_enable"] and self._held["prbs_source"] == PrbsSource.PLC.value
            self._prbs = self._generator() if runs else None

    def _generator(self) -> PlcPrbs:
        held = self._held
        return PlcPrbs(float(held["prbs_amplitude"]), int(held["prbs_divider"]), int(held["prbs_seed"]))

    def _prbs_nm(self) -> float:
        return 0.0 if self._prbs is None or not self._permits() else self._prbs.torque_nm

    def _permits(self) -> bool:
        return self._permissive and self._time_s - self._seen_s <= self._setup.host_timeout_s

    def _cycle(self) -> None:
        self._cycles += 1
        if self._prbs is not None:
            self._prbs.clock()

    def _fail(self) -> None:
        if self._time_s >= self._faults.clutch_closes_at_s:
            self._clutch = ClutchState.CLOSED
        if self._time_s >= self._faults.mode_changes_at_s:
            self._drive_mode = DriveMode.ELECTRIC
        if self._time_s >= self._faults.permissive_withdrawn_at_s:
            self._permissive = False


def _clutch_in(mode: DriveMode) -> ClutchState:
    return ClutchState.CLOSED if mode is DriveMode.PARALLEL else ClutchState.OPEN


def _nothing(value: Value) -> bool:
    return False
