"""What recordings of pulses and PRBS say of a driveline: signs, gains, delays, and the ratio of two inverters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from estimator.signals.correlation import reading_lag
from estimator.signals.decimate import decimate
from estimator.signals.record import BoolArray, FloatArray, Record
from hil.recording import read_record, read_table
from hil.recording.columns import FLAGS, SPEED, TIME, TORQUE_M1, TORQUE_M2

if TYPE_CHECKING:
    from estimator.identification.spectral import SpectralEstimate


REFERENCE = {"m1": "torque_ref_m1_nm", "m2": "torque_ref_m2_nm"}
READING = {"m1": TORQUE_M1, "m2": TORQUE_M2}

DRAWN = 400
"""Stretches of a course that is kept for the report: two samples each."""

DIGITS = 6
"""Significant digits of what is kept to be drawn."""

Z95 = 1.959963984540054
"""97.5 % point of the normal distribution."""

TRUSTED = 0.2
"""Share of its value that a parameter of a model from here is trusted to at best: temperature, load and tyres move it
by as much, however short its interval."""

RINGING_S = 0.25
"""Width of the average [s]: two periods and more of a driveline's resonance, from 8 Hz up; a quarter of a pulse."""

HIGH_PASS_HZ = 0.3
"""As in the identification: what is slower is the road's."""

LOW_HZ, HIGH_HZ = 0.8, 20.0
"""Lines used [Hz]: above twice the high-pass, below where a resolver's noise covers a driveline's response."""

COHERENT = 0.5
"""A line is used where at least half of the speed's power is the torque's, in both tests."""

FEWEST_LINES = 6


def columns_of(path: Path) -> Mapping[str, FloatArray]:
    """Return the numeric columns of a recording, each of shape (N,)."""
    names = [TIME, SPEED, FLAGS, *READING.values(), *REFERENCE.values()]
    return read_table(path).numeric(names)


def record_of(path: Path) -> Record:
    """Read a recording of the commissioning; `RecordingError` where it can't be used."""
    return read_record(path)


def thinned(x: FloatArray, *ys: FloatArray) -> list[list[float]]:
    """Return courses thinned for drawing, x first; the peaks of the last one are kept."""
    from hil.report.figures import extremes  # brings the plot library

    kept = extremes(ys[-1], DRAWN)
    return [rounded(values[kept]) for values in (x, *ys)]


def rounded(values: FloatArray) -> list[float]:
    """Return numbers with the digits a picture needs."""
    return [float(f"{value:.{DIGITS}g}") for value in np.asarray(values, dtype=np.float64).tolist()]


def json_safe(evidence: Any) -> Any:
    """Return evidence with what JSON has not, NaN and infinity, as None."""
    if isinstance(evidence, Mapping):
        return {str(key): json_safe(value) for key, value in evidence.items()}
    if isinstance(evidence, list | tuple):
        return [json_safe(value) for value in evidence]
    if isinstance(evidence, np.floating | float):
        return float(evidence) if np.isfinite(evidence) else None
    return int(evidence) if isinstance(evidence, np.integer) else evidence


class Measured(NamedTuple):
    """A value and half the width of its 95 % interval; infinite where the data don't tell."""

    value: float  # NaN where there is nothing to measure it from
    ci95: float  # in the unit of the value

    def is_within(self, low: float, high: float) -> bool | None:
        """Tell whether the value lies in a range: None where the interval is on both sides of a limit."""
        if low <= self.value - self.ci95 and self.value + self.ci95 <= high:
            return True
        if self.value + self.ci95 < low or self.value - self.ci95 > high:
            return False
        return None

    def exceeds(self, size: float) -> bool:
        """Tell whether the value is surely larger than a size, either way."""
        return abs(self.value) - self.ci95 > size

    def shown(self, unit: str = "", scale: float = 1.0) -> str:
        """Return ``3.1 ± 0.4 %``: the interval with two digits, the value with as many places."""
        value, spread = scale * self.value, scale * self.ci95
        if not math.isfinite(spread) or not math.isfinite(value):
            return "not determined"
        places = 0 if spread <= 0.0 else max(0, 1 - math.floor(math.log10(spread)))
        return f"{value:z.{places}f} ± {spread:.{places}f} {unit}".rstrip()

    def shown_as(self, above: str, below: str, unit: str = "", scale: float = 1.0) -> str:
        """Return ``0.12 ± 0.09 ms earlier``: the size, and a word for each sign."""
        size = Measured(abs(self.value), self.ci95)
        return f"{size.shown(unit, scale)} {below if self.value < 0.0 else above}"


def of_repeats(values: FloatArray) -> Measured:
    """Return the mean of independent repeats, shape (n,), and its interval by Student's t; n = 1 tells nothing."""
    n = values.shape[0]
    if n < 2:
        return Measured(float(np.mean(values)) if n else math.nan, math.inf)
    from scipy.stats import t as student  # half a second, and the bus comes first

    spread = float(student.ppf(0.975, n - 1) * np.std(values, ddof=1) / math.sqrt(n))
    return Measured(float(np.mean(values)), spread)


@dataclass(frozen=True, slots=True)
class PulseResponse:
    """Of one inverter: speed over that of the rigid vehicle, and torque reading over torque reference."""

    speed: Measured  # 1: as the rig file's inertia has it; negative: the other way round
    reading: Measured  # 1: as commanded; negative: the other way round


def pulse_response(
    reference_nm: FloatArray,
    reading_nm: FloatArray,
    speed_rad_s: FloatArray,
    inertia_kg_m2: float,
    period_s: float,
    waves: int,
    wave_samples: int,
    lead_samples: int,
) -> PulseResponse:
    """Return the response to waves of pulses, all courses of shape (N,); the first begins at ``lead_samples``."""
    rigid = averaged(
        np.concatenate([[0.0], np.cumsum(reference_nm)[:-1]]) * period_s / inertia_kg_m2, RINGING_S, period_s
    )
    winding = averaged(np.gradient(reference_nm, period_s), RINGING_S, period_s)
    smooth = averaged(speed_rad_s, RINGING_S, period_s)
    starts = [lead_samples + i * wave_samples for i in range(waves)]
    parts = [slice(start, start + wave_samples) for start in starts if start + wave_samples <= rigid.shape[0]]
    speed = np.array([_slope(smooth[part], rigid[part], winding[part]) for part in parts])
    reading = np.array([_gain(reading_nm[part], reference_nm[part]) for part in parts])
    return PulseResponse(of_repeats(speed), of_repeats(reading))


def averaged(x: FloatArray, width_s: float, period_s: float) -> FloatArray:
    """Return the centred moving average over a time [s], shape as given; the ends are held beyond the data."""
    half = max(0, round(0.5 * width_s / period_s))
    held = np.pad(x, half, mode="edge")
    width = 2 * half + 1
    return np.asarray(np.convolve(held, np.full(width, 1.0 / width), mode="valid"), dtype=np.float64)


def _slope(y: FloatArray, x: FloatArray, *others: FloatArray) -> float:
    """Regress y on x, others, a constant and a drift; return the coefficient of x."""
    drift = np.linspace(-0.5, 0.5, y.shape[0])
    solution = np.linalg.lstsq(np.column_stack([x, *others, np.ones_like(x), drift]), y, rcond=None)[0]
    return float(solution[0])


def _gain(reading: FloatArray, reference: FloatArray) -> float:
    """Return the gain at the lag of best agreement: a reading is one or two cycles behind its reference."""
    lag = reading_lag(reading, reference)
    n = reading.shape[0] - lag
    return _slope(reading[lag:], reference[:n])


@dataclass(frozen=True, slots=True)
class ResponseRatio:
    """Gain of m2 over m1, and how much later m2 acts [s]; both undetermined with too few coherent lines."""

    gain: Measured  # 1 where undetermined, with an infinite interval
    delay_s: Measured  # negative where m2 acts earlier
    lines: int  # frequencies at which both tests are coherent


def response_ratio(first: Record, second: Record) -> ResponseRatio:
    """Compare the second test's response with the first's."""
    a, b = _response(first), _response(second)
    f = a.frequency_hz
    use = (f >= LOW_HZ) & (f <= HIGH_HZ) & (a.coherence >= COHERENT) & (b.coherence >= COHERENT)
    if int(use.sum()) < FEWEST_LINES:
        return ResponseRatio(Measured(1.0, np.inf), Measured(0.0, np.inf), int(use.sum()))
    return _ratio(a, b, use)


def _response(record: Record) -> SpectralEstimate:
    from estimator.identification.spectral import spectral_estimate  # half a second, and the bus comes first

    return spectral_estimate(decimate(record, 1, HIGH_PASS_HZ))


def _ratio(a: SpectralEstimate, b: SpectralEstimate, use: BoolArray) -> ResponseRatio:
    omega = 2.0 * np.pi * a.frequency_hz[use]

    def errors(x: FloatArray) -> FloatArray:
        gain, delay_ms = x
        difference = b.response[use] - gain * np.exp(-1e-3j * omega * delay_ms) * a.response[use]
        spread = np.hypot(b.magnitude_std[use], gain * a.magnitude_std[use])
        return np.concatenate([difference.real / spread, difference.imag / spread])

    from scipy.optimize import least_squares

    start = float(np.real(np.vdot(a.response[use], b.response[use])) / np.sum(np.abs(a.response[use]) ** 2))
    found = least_squares(errors, [start, 0.0])
    jacobian = np.asarray(found.jac)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    misfit = max(1.0, 2.0 * found.cost / max(1, found.fun.shape[0] - 2))  # a driveline that changed between the tests
    gain_std, delay_std = np.sqrt(misfit * np.diag(covariance))
    return ResponseRatio(
        Measured(float(found.x[0]), Z95 * float(gain_std)),
        Measured(1e-3 * float(found.x[1]), 1e-3 * Z95 * float(delay_std)),
        int(use.sum()),
    )
