"""What a method says of one bus, and the bus with its data."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import butter, lfilter, lfilter_zi

from estimator.signals.record import Record
from tests.benchmarks.buses.bus import Bus, draw_bus
from tests.benchmarks.buses.drive import PERIOD_S, World, drive
from tests.benchmarks.buses.line import Array

HIGH_PASS_HZ = 0.3
BAND_HZ = (2.0, 25.0)
LIGHTLY_DAMPED = 0.5
"""From this damping ratio on a pair is no resonance."""

SECONDS = 30.0


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One bus and its cruise: as recorded, and high-passed for whoever takes plain arrays."""

    bus: Bus
    record: Record
    u: Array
    y: Array

    @property
    def truth(self) -> dict[str, float]:
        """What is looked for, by name."""
        frequency_hz, damping = self.bus.line.resonance()
        return {"frequency": frequency_hz, "damping": damping, **self.bus.line.parameters}


def make_case(seed: int, world: World) -> Case:
    """Drive the bus of a seed."""
    bus = draw_bus(seed)
    record = drive(bus, SECONDS, world=world)
    return Case(bus, record, high_passed(record.torque_nm.sum(axis=1)), high_passed(record.output))


def high_passed(x: Array) -> Array:
    """Return a signal without its slow part, from the mean of its first second on."""
    b, a = butter(1, HIGH_PASS_HZ, "highpass", fs=1.0 / PERIOD_S)
    begin = x[: round(1.0 / PERIOD_S)].mean()
    return np.asarray(lfilter(b, a, x, zi=lfilter_zi(b, a) * begin)[0], dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Interval:
    """A printed estimate: value, 95 % interval, and whether it is called determined."""

    value: float
    low: float
    high: float
    is_determined: bool = True

    def holds(self, truth: float) -> bool:
        """Tell whether the interval holds the truth."""
        return self.low <= truth <= self.high


@dataclass(frozen=True, slots=True)
class Answer:
    """What a method says: resonance [Hz] and damping ratio, NaN where it has none; what it prints with intervals; why.

    ``cpu_s`` is the processor time of the method alone [s].
    """

    frequency_hz: float = math.nan
    damping: float = math.nan
    intervals: Mapping[str, Interval] = field(default_factory=dict)
    refusal: str = ""
    cpu_s: float = math.nan

    @property
    def is_there(self) -> bool:
        """Tell whether there is a resonance in it."""
        return math.isfinite(self.frequency_hz) and math.isfinite(self.damping)


Method = Callable[[Case], Answer]


def of_poles(poles: Array) -> Answer:
    """Return the least damped pair in the band as an answer; poles in z at the recordings' period."""
    z = np.asarray(poles, dtype=np.complex128)
    s = np.log(z[z.imag > 0.0]) / PERIOD_S
    frequency_hz, damping = np.abs(s) / (2.0 * math.pi), -s.real / np.abs(s)
    low, high = BAND_HZ
    there = (frequency_hz > low) & (frequency_hz < high) & (damping > 0.0) & (damping < LIGHTLY_DAMPED)
    if not there.any():
        return Answer(refusal="no lightly damped pair of poles in the band")
    at = int(np.argmin(np.where(there, damping, np.inf)))
    return Answer(float(frequency_hz[at]), float(damping[at]))
