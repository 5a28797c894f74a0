"""Recording of the truth: from the true speed to the number in the file, and what goes wrong on the way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from hil.proof.truth.bus import PERIOD_S
from hil.proof.truth.physics import FloatArray

TORQUE_QUANTUM_NM = 0.6  # 0.1 % of a rated torque of 600 Nm: the resolution of object 0x6077

TORQUE_NOISE_NM = 0.5
SPEED_NOISE_RAD_S = 0.05

CURVATURE_SPEED_RAD_S = 100.0  # speed at which the curvature's share of the reading is missing

FLAG_M1, FLAG_M2 = 1, 2  # quality flags of a row: an inverter did not answer. The speed comes from m1


@dataclass(frozen=True, slots=True)
class Acquisition:
    """The chain from the resolver to the file; faultless at its defaults."""

    curvature: float = 0.0  # change of the speed's gain with speed
    sign_blind: bool = False  # the magnitude of the speed is read
    grid_rad_s: float = 0.0  # step of the speed's number format [rad/s]
    count_rad: float = 0.0  # angle of an encoder's count; 0: there is none
    count_time_s: float = 0.0  # time over which counts are made to a speed
    clock_error: float = 0.0  # by which speeds are sampled later than their time, over that time
    jitter_s: float = 0.0  # greatest deviation of a speed's sampling instant from its time
    stamps_told: bool = False  # whether ``time_s`` has the true instants
    stale_share: float = 0.0  # share of samples that begin a run of repeats, at random
    stale_most: int = 1  # longest run of repeats
    stale_every: int = 0  # one in so many samples repeats the one before it, in place of random ones; 0: none
    stale_rows: bool = False  # whether torques are repeated with the speed
    lost_share: float = 0.0  # share of samples that begin a run of lost ones
    lost_most: int = 1  # longest run of lost ones
    lost_m1: bool = False  # whether the torque of m1 is lost
    lost_m2: bool = False  # whether the torque of m2 is lost
    lost_speed: bool = False  # whether the speed is lost
    lost_as_zero: bool = False  # whether a lost sample is recorded as 0, without a flag
    spike_share: float = 0.0  # share of the speeds with a wrong bit
    spike_rad_s: float = 0.0  # greatest of these errors


FAULTLESS = Acquisition()


@dataclass(frozen=True, slots=True)
class Noise:
    """What a faultless sensor adds to a quantity: standard deviations, and the resolution of the torque.

    Besides the white noise of speed and torque there may be coloured noise of the speed, and a drift of each torque
    reading: of first order, with these corner frequencies.
    """

    speed_rad_s: float = SPEED_NOISE_RAD_S  # white
    torque_nm: float = TORQUE_NOISE_NM  # white, of each inverter's reading
    torque_quantum_nm: float = TORQUE_QUANTUM_NM  # step of each inverter's reading; 0: none
    coloured_rad_s: float = 0.0  # of the speed, on top of the white one
    coloured_hz: float = 5.0  # its corner frequency
    torque_drift_nm: float = 0.0  # of each inverter's reading
    torque_drift_hz: float = 0.05  # its corner frequency


USUAL = Noise()


def torque_reading(torque_nm: FloatArray, rng: np.random.Generator, noise: Noise = USUAL) -> FloatArray:
    """Return the inverter's torque actual value [Nm] for a true current torque."""
    noisy = torque_nm + rng.normal(0.0, noise.torque_nm, torque_nm.shape)
    noisy += coloured(noise.torque_drift_nm, noise.torque_drift_hz, torque_nm.shape, rng)
    if noise.torque_quantum_nm <= 0.0:
        return noisy
    return np.round(noisy / noise.torque_quantum_nm) * noise.torque_quantum_nm


def speed_reading(speed_rad_s: FloatArray, rng: np.random.Generator, noise: Noise = USUAL) -> FloatArray:
    """Return the resolver's noisy speed [rad/s]."""
    white = rng.normal(0.0, noise.speed_rad_s, speed_rad_s.shape)
    return speed_rad_s + white + coloured(noise.coloured_rad_s, noise.coloured_hz, speed_rad_s.shape, rng)


def coloured(size: float, corner_hz: float, shape: tuple[int, ...], rng: np.random.Generator) -> FloatArray:
    """Return noise of first order along the first axis, of a standard deviation and corner; none draws no numbers."""
    if size == 0.0:
        return np.zeros(shape)
    kept = float(np.exp(-2.0 * np.pi * corner_hz * PERIOD_S))
    driven = rng.normal(0.0, size * np.sqrt(1.0 - kept**2), shape)
    driven[0] = rng.normal(0.0, size, shape[1:])
    noise: FloatArray = lfilter([1.0], [1.0, -kept], driven, axis=0)
    return noise


def sampling_instants_s(time_s: FloatArray, acquisition: Acquisition, rng: np.random.Generator) -> FloatArray:
    """Return when each speed is truly sampled [s], shape (N,); none is before the recording begins."""
    instants = time_s * (1.0 + acquisition.clock_error)
    if acquisition.jitter_s > 0.0:
        instants = instants + rng.uniform(-acquisition.jitter_s, acquisition.jitter_s, time_s.shape)
    return np.maximum(instants, 0.0)


def speed_as_read(
    speed_rad_s: FloatArray, acquisition: Acquisition, rng: np.random.Generator, noise: Noise = USUAL
) -> FloatArray:
    """Return what the sensor gives for a true speed [rad/s], shape (N,)."""
    a = acquisition
    reading = speed_rad_s * (1.0 - a.curvature * np.abs(speed_rad_s) / CURVATURE_SPEED_RAD_S)
    reading = speed_reading(reading, rng, noise)
    if a.sign_blind:
        reading = np.abs(reading)
    if a.grid_rad_s > 0.0:
        reading = np.round(reading / a.grid_rad_s) * a.grid_rad_s
    if a.count_rad > 0.0:
        reading = _counted(reading, a.count_rad, a.count_time_s, rng)
    return reading


def _counted(speed_rad_s: FloatArray, count_rad: float, time_s: float, rng: np.random.Generator) -> FloatArray:
    """Return what the counts of an encoder make of a speed, in a time so short that it is constant in it.

    Where in a count the shaft stands when the time begins is as good as random.
    """
    counts = np.floor(speed_rad_s * time_s / count_rad + rng.uniform(0.0, 1.0, speed_rad_s.shape))
    return counts * count_rad / time_s


IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Rows:
    """Columns of a recording, shape (N,) each; ``flags`` is None where the recorder has none to give."""

    torque_m1_nm: FloatArray  # NaN, or 0 without a flag, where it is lost
    torque_m2_nm: FloatArray  # the same
    speed_rad_s: FloatArray  # likewise
    flags: IntArray | None = None


def as_recorded(rows: Rows, acquisition: Acquisition, rng: np.random.Generator) -> Rows:
    """Return the rows as the file has them; faultless ones come back as they are."""
    for step in (_spiked, _stale, _lost):
        rows = step(rows, acquisition, rng)
    return rows


def _spiked(rows: Rows, a: Acquisition, rng: np.random.Generator) -> Rows:
    if a.spike_share <= 0.0:
        return rows
    n = rows.speed_rad_s.size
    error = rng.uniform(0.3, 1.0, n) * rng.choice([-1.0, 1.0], n) * a.spike_rad_s
    return replace(rows, speed_rad_s=rows.speed_rad_s + np.where(rng.random(n) < a.spike_share, error, 0.0))


def _stale(rows: Rows, a: Acquisition, rng: np.random.Generator) -> Rows:
    n = rows.speed_rad_s.size
    if a.stale_every > 0:
        repeats = np.arange(n) % a.stale_every == a.stale_every - 1
    elif a.stale_share > 0.0:
        repeats = runs(n, a.stale_share, a.stale_most, rng)
    else:
        return rows
    fresh = np.maximum.accumulate(np.where(repeats, 0, np.arange(n)))
    if not a.stale_rows:
        return replace(rows, speed_rad_s=rows.speed_rad_s[fresh])
    return replace(
        rows,
        torque_m1_nm=rows.torque_m1_nm[fresh],
        torque_m2_nm=rows.torque_m2_nm[fresh],
        speed_rad_s=rows.speed_rad_s[fresh],
    )


def _lost(rows: Rows, a: Acquisition, rng: np.random.Generator) -> Rows:
    if a.lost_share <= 0.0:
        return rows
    lost = runs(rows.speed_rad_s.size, a.lost_share, a.lost_most, rng)
    blank = 0.0 if a.lost_as_zero else np.nan
    from_m1 = lost & (a.lost_m1 or a.lost_speed)
    flags = FLAG_M1 * from_m1.astype(np.int64) + FLAG_M2 * (lost & a.lost_m2).astype(np.int64)
    return Rows(
        torque_m1_nm=np.where(lost & a.lost_m1, blank, rows.torque_m1_nm),
        torque_m2_nm=np.where(lost & a.lost_m2, blank, rows.torque_m2_nm),
        speed_rad_s=np.where(lost & a.lost_speed, blank, rows.speed_rad_s),
        flags=None if a.lost_as_zero else flags,
    )


def runs(n: int, share: float, most: int, rng: np.random.Generator) -> BoolArray:
    """Return where runs of 1 to ``most`` samples are that begin at a share of the n samples; never at the first."""
    hit = np.zeros(n, dtype=np.bool_)
    for start in np.flatnonzero(rng.random(n) < share):
        hit[start : start + rng.integers(1, most + 1)] = True
    hit[0] = False
    return hit
