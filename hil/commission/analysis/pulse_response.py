"""What a standing vehicle does under pulses of torque: sign and size of the speed, and of the torque reading.

In each wave of pulses the speed is regressed on what a rigid vehicle of known inertia J would do, and on what a shaft
winds up meanwhile, which the motor turns ahead::

    w(t) = s r(t) + h dT_ref/dt + o + d (t - t_0),        r(t) = integral of T_ref dt / J

Both sides are averaged over `RINGING_S` first: the line rings after every step, and neither term does.
``s`` is 1 where torque, speed and inertia have the right scale, -1 where one of them has the wrong sign. Offset and
drift take what is not of the pulses. The waves are repeats: their scatter gives the interval, whatever rings or drifts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.signals.record import FloatArray
from hil.commission.analysis.measured import Measured, of_repeats

RINGING_S = 0.25
"""Width of the average [s]: two periods and more of a driveline's resonance, from 8 Hz up; a quarter of a pulse."""


@dataclass(frozen=True, slots=True)
class PulseResponse:
    """Of one inverter: speed over that of the rigid vehicle, and torque reading over torque reference."""

    speed: Measured
    reading: Measured


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
    """Measure the response to waves of pulses.

    Parameters
    ----------
    reference_nm, reading_nm, speed_rad_s : ndarray, shape (N,)
        Torque reference and torque reading of the inverter, and the motor speed.
    inertia_kg_m2
        Total inertia at the motor shaft.
    period_s
        Sampling period.
    waves, wave_samples, lead_samples
        How many waves, the length of one, and of what is before the first.
    """
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


def reading_lag(reading: FloatArray, reference: FloatArray, most: int = 5) -> int:
    """Return by how many samples a reading follows its reference: where their covariance is largest in size."""
    n = reading.shape[0] - most
    centred = reference[:n] - np.mean(reference[:n])
    return int(np.argmax([abs(float(centred @ reading[lag : lag + n])) for lag in range(most + 1)]))
