"""High-pass and anti-aliased decimation of torque and speed, the same filters in both.

The model between u and y survives any linear filter that both pass through. Two are used, in this order:

The same causal loop serves the rig on line, sample by sample, and a recording as a block, with equal bits.

1. First-order high-pass: each signal minus its exponentially weighted mean, ``m += (1 - p)(x - m)`` with the
   pole ``p = exp(-2 pi f_c T)``. It takes away what a road grade or the driver does slowly, which a model of
   the driveline can't explain. Trials gave 0.3 Hz; see DESIGN "Identification".
2. Linear-phase low-pass (FIR, Hamming window) ahead of keeping every M-th sample. It delays by a whole number
   of the *kept* samples, which :func:`decimate` takes out of the time base.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimator.compiled import compiled
from estimator.errors import BadShape
from estimator.signals.record import BoolArray, FloatArray, IntArray, Record, sliced
from estimator.signals.settings import Requirement, is_positive, require

# Rows of the signal arrays.
U = 0
Y = 1

# Places in `counters`.
PHASE = 0  # samples until the next output
SPOILT = 1  # samples during which the window of the filter still holds a bad one
STARTED = 2  # 1 once the running means have a first value; then the sample counts towards the mask

# Places in `level`, after the running means of u and y in U and Y.
HELD_U = 2
HELD_Y = 3
CONTAMINATION = 4

LARGEST = 1e30  # beyond it a value is no measurement, as for the estimators; the means can't overflow below
UNTRUSTED = 0.5  # share of held values in a running mean from which on it is not trusted

HALF_LENGTH = 8
"""Delay of the low-pass in kept samples; its length is ``2 * 8 * M + 1`` taps.

A Hamming window of L taps goes from one band to the other within 3.3 / L of the sampling frequency (Oppenheim
and Schafer, Discrete-Time Signal Processing, window design): for M = 2 at 10 ms, L = 33 and 10 Hz. With the
edge at the new Nyquist frequency, 25 Hz, what lies below 20 Hz passes untouched, and what folds back there,
from above 30 Hz, is damped by 50 dB. A lower edge would empty the band below the Nyquist frequency, and the
models' spare pole, with nothing to hold it, drifts across z = -1: seen in half of 24 simulated cruises at
0.75, in none at 1.
"""

HIGH_PASS_HZ = 0.3
"""Corner of the high-pass: below, a road grade and the driver move the speed more than the torque does."""

MOST_FACTOR = 10_000  # a low-pass of 160,001 taps; the models' 20 ms of samples every 2 µs
EDGE = 1.0  # edge of the low-pass (half amplitude) in parts of the new Nyquist frequency

RASTER_S = 0.01
"""Longest block [s]: its means see up to 50 Hz, the upper end of the paper's band for driveline resonances."""

MOST_BLOCKS = 60_000
"""Blocks that off-line models are fitted to, ten minutes at 10 ms: they know a resonance to a few parts in 100,000, and
a longer recording is of a driveline that warms meanwhile. Each costs 6 kilobytes."""


@compiled
def _take(u: float, y: float, okay: bool, level: FloatArray) -> bool:
    """Hold the last good value in place of one that can't be used; tell whether both could be."""
    u_fits = abs(u) <= LARGEST
    y_fits = okay and abs(y) <= LARGEST
    if u_fits:
        level[HELD_U] = u
    if y_fits:
        level[HELD_Y] = y
    return okay and u_fits and y_fits


@compiled
def _remove_mean(good: bool, share: float, level: FloatArray, window: FloatArray) -> None:
    """High-pass both signals into the newest place of the window: x minus its exponentially weighted mean."""
    for row in (U, Y):
        held = level[HELD_U + row]
        level[row] += share * (held - level[row])
        for i in range(window.shape[1] - 1, 0, -1):
            window[row, i] = window[row, i - 1]
        window[row, 0] = held - level[row]
    level[CONTAMINATION] += share * ((0.0 if good else 1.0) - level[CONTAMINATION])


@compiled
def decimate_block(
    u: FloatArray,
    y: FloatArray,
    okay: BoolArray,
    share: float,
    factor: int,
    taps: FloatArray,
    counters: np.ndarray,
    level: FloatArray,
    window: FloatArray,
    out: FloatArray,
    out_okay: BoolArray,
) -> int:
    """Run the samples of a block through high-pass, low-pass and decimation; return the number of outputs."""
    produced = 0
    for t in range(u.shape[0]):
        good = _take(u[t], y[t], okay[t], level)
        if counters[STARTED] == 0 and good:
            level[U], level[Y] = u[t], y[t]
            counters[STARTED] = 1
        _remove_mean(good, share, level, window)
        counters[SPOILT] = max(counters[SPOILT] - 1, 0)
        if not good or level[CONTAMINATION] > UNTRUSTED:
            counters[SPOILT] = taps.shape[0]
        if counters[PHASE] == 0:
            counters[PHASE] = factor
            filtered_u, filtered_y = 0.0, 0.0
            for i in range(taps.shape[0]):
                filtered_u += taps[i] * window[U, i]
                filtered_y += taps[i] * window[Y, i]
            out[U, produced], out[Y, produced] = filtered_u, filtered_y
            out_okay[produced] = counters[SPOILT] == 0 and counters[STARTED] == 1
            produced += 1
        counters[PHASE] -= 1
    return produced


@dataclass(frozen=True, slots=True)
class Decimated:
    """A block of kept samples: ``u``, ``y`` and ``okay``, each of shape (n,)."""

    u: FloatArray
    y: FloatArray
    okay: BoolArray


def low_pass_length(factor: float) -> float:
    """Return how many taps the anti-aliasing filter of a factor above 1 has."""
    return 2 * HALF_LENGTH * factor + 1


def low_pass_taps(factor: int) -> FloatArray:
    """Return the taps of the low-pass for a decimation: windowed sinc (Hamming), gain 1 at 0 Hz."""
    if factor == 1:
        return np.ones(1)
    length = round(low_pass_length(factor))
    ideal = np.sinc(EDGE / factor * (np.arange(length) - (length - 1) / 2.0))
    windowed = ideal * np.hamming(length)  # as scipy.signal.firwin, which takes a second to import
    return windowed / windowed.sum()


class Decimator:
    """The chain with its state, for samples as they come."""

    __slots__ = ("_counters", "_factor", "_level", "_share", "_taps", "_window", "sample_time_s")

    def __init__(self, sample_time_s: float, factor: int, high_pass_hz: float = HIGH_PASS_HZ) -> None:
        nyquist_hz = 0.5 / (sample_time_s * factor) if sample_time_s * factor > 0 else math.inf
        require(
            "decimation",
            (
                Requirement("sample_time_s", sample_time_s, is_positive(sample_time_s), "a period above 0 s"),
                Requirement("factor", factor, 1 <= factor <= MOST_FACTOR, f"1 to {MOST_FACTOR}; is time in s?"),
                Requirement(
                    "high_pass_hz",
                    high_pass_hz,
                    is_positive(high_pass_hz) and high_pass_hz < nyquist_hz,
                    f"a corner above 0 Hz and below {nyquist_hz:g} Hz, the Nyquist frequency of what is kept",
                ),
            ),
        )
        self.sample_time_s = sample_time_s * factor
        self._factor = factor
        self._share = 1.0 - math.exp(-2.0 * math.pi * high_pass_hz * sample_time_s)
        self._taps = low_pass_taps(factor)
        self._counters = np.zeros(3, dtype=np.int64)
        self._counters[SPOILT] = self._taps.shape[0]
        self._level = np.zeros(5)
        self._window = np.zeros((2, self._taps.shape[0]))

    @property
    def share(self) -> float:
        """Weight of a new sample in the running means of the high-pass."""
        return self._share

    @property
    def taps(self) -> FloatArray:
        """Taps of the low-pass, shape (L,), a copy."""
        return self._taps.copy()

    @property
    def delay_samples(self) -> int:
        """Kept samples by which the output is late."""
        return HALF_LENGTH if self._factor > 1 else 0

    def run(self, u: FloatArray, y: FloatArray, okay: BoolArray) -> Decimated:
        """Take a block of samples; the block may have any length, also 1."""
        if not (u.ndim == 1 and u.shape == y.shape == okay.shape):
            raise BadShape(
                f"decimation: u, y and okay have the shapes {u.shape}, {y.shape}, {okay.shape}, expected one "
                "shape (N,). Give every signal one value per sample."
            )
        room = u.shape[0] // self._factor + 1
        out, out_okay = np.empty((2, room)), np.empty(room, dtype=np.bool_)
        n = decimate_block(
            np.ascontiguousarray(u, dtype=np.float64),
            np.ascontiguousarray(y, dtype=np.float64),
            np.ascontiguousarray(okay, dtype=np.bool_),
            self._share,
            self._factor,
            self._taps,
            self._counters,
            self._level,
            self._window,
            out,
            out_okay,
        )
        return Decimated(out[0, :n].copy(), out[1, :n].copy(), out_okay[:n].copy())

    def state(self) -> dict[str, FloatArray | IntArray]:
        """Return what it remembers, by name: arrays that `restore` takes."""
        return {"counters": self._counters.copy(), "level": self._level.copy(), "window": self._window.copy()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a state of a decimator with the same settings."""
        self._counters[:], self._level[:], self._window[:] = state["counters"], state["level"], state["window"]


def high_passed(record: Record, high_pass_hz: float = HIGH_PASS_HZ) -> Record:
    """Return a recording's total torque and output through the high-pass alone, at its own period; for use off line."""
    good = np.flatnonzero(record.okay)
    rows = np.arange(record.okay.shape[0])
    bridged = np.interp(rows, good, record.output[good]) if good.size else np.zeros(rows.shape)
    passed = Decimator(record.sample_time_s, 1, high_pass_hz).run(
        record.total_torque_nm, bridged, np.ones_like(record.okay)
    )
    return Record(
        name=record.name,
        sample_time_s=record.sample_time_s,
        time_s=record.time_s,
        torque_nm=passed.u[:, np.newaxis],
        output=passed.y,
        okay=record.okay,
        kind=record.kind,
        location=record.location,
        torque_okay=record.read,
    )


def decimate(record: Record, factor: int, high_pass_hz: float = HIGH_PASS_HZ) -> Record:
    """Filter a recording's total torque and output and keep one in ``factor`` samples."""
    chain = Decimator(record.sample_time_s, factor, high_pass_hz)
    kept = chain.run(record.total_torque_nm, record.output, record.okay)
    start_s = float(record.time_s[0]) if record.time_s.size else 0.0
    kept_samples = np.arange(kept.u.shape[0], dtype=np.float64) - chain.delay_samples
    return Record(
        name=record.name,
        sample_time_s=chain.sample_time_s,
        time_s=start_s + kept_samples * chain.sample_time_s,
        torque_nm=kept.u[:, np.newaxis],
        output=kept.y,
        okay=kept.okay,
        kind=record.kind,
        location=record.location,
    )


def first_part(record: Record) -> Record:
    """Return the recording, or its first MOST blocks where it is longer."""
    most = MOST_BLOCKS * block_of(record.sample_time_s)
    return record if record.time_s.shape[0] <= most else sliced(record, slice(0, most))


def block_of(sample_time_s: float) -> int:
    """Return how many samples of a period [s] make a block."""
    return max(1, math.floor(RASTER_S / sample_time_s * (1.0 + 1e-6)))


class Blocks:
    """Means over whole blocks, of the measured samples of each; what is left over at the end is not used."""

    def __init__(self, okay: BoolArray, size: int) -> None:
        self._size, self._n = size, okay.shape[0] // size
        self._good = okay[: self._n * size].reshape(self._n, size)
        self.okay: BoolArray = 2 * self._good.sum(axis=1) >= size
        """Blocks of which half or more was measured, shape (n,)."""

    def mean(self, x: FloatArray) -> FloatArray:
        """Return the mean of each block's good samples; 0 for a block without enough of them."""
        good = self._good.reshape(self._n, self._size, *(1,) * (x.ndim - 1))
        parts = x[: self._n * self._size].reshape(self._n, self._size, *x.shape[1:])
        count = np.maximum(good.sum(axis=1), 1)
        means = np.where(good, parts, 0.0).sum(axis=1) / count
        means[~self.okay] = 0.0
        return np.asarray(means, dtype=np.float64)
