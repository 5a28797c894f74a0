"""High-pass and anti-aliased decimation of torque and speed, the same filters in both.

The model between u and y survives any linear filter that both pass through. Two are used, in this order:

1. First-order high-pass: each signal minus its exponentially weighted mean, ``m += (1 - p)(x - m)`` with the
   pole ``p = exp(-2 pi f_c T)``. It takes away what a road grade or the driver does slowly, which a model of
   the driveline can't explain. Trials gave 0.3 Hz; see DESIGN "Identification".
2. Linear-phase low-pass (FIR, Hamming window) ahead of keeping every M-th sample. It delays by a whole number
   of the *kept* samples, which :func:`decimate` takes out of the time base.

The same causal loop serves the rig on line, sample by sample, and a recording as a block, with equal bits.

Masks: a sample that is not okay, or no number up to 1e30, is replaced by the last good one and spoils every output
whose low-pass window holds it. It also enters the running mean; while more than half of that mean is such
held values, outputs stay spoilt. The first outputs, whose window reaches back before the recording, are
spoilt too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimator.errors import BadShape
from estimator.signals.decimate_kernel import SPOILT, decimate_block
from estimator.signals.record import BoolArray, FloatArray, IntArray, Record
from estimator.signals.settings import Requirement, is_positive, require

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

MOST_FACTOR = 10_000
"""A low-pass of 160,001 taps; the models' 20 ms of samples every 2 µs."""

EDGE = 1.0
"""Edge of the low-pass (half amplitude) in parts of the new Nyquist frequency."""


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
    """Return the taps of the anti-aliasing filter, shape (16 * factor + 1,), sum 1; one tap for factor 1."""
    if factor == 1:
        return np.ones(1)
    length = round(low_pass_length(factor))
    ideal = np.sinc(EDGE / factor * (np.arange(length) - (length - 1) / 2.0))
    windowed = ideal * np.hamming(length)  # as scipy.signal.firwin, which takes a second to import
    taps: FloatArray = windowed / windowed.sum()
    return taps


class Decimator:
    """The chain with its state, for samples as they come.

    Parameters
    ----------
    sample_time_s : float
        Sampling period of the samples that will come [s].
    factor : int
        One in ``factor`` samples is kept.
    high_pass_hz : float
        Corner of the high-pass [Hz].

    Raises
    ------
    BadSetting
        If the factor is below 1 or above `MOST_FACTOR`, or the corner is not between 0 and the new Nyquist frequency.
    """

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
        """Delay of the kept samples, counted in kept samples."""
        return HALF_LENGTH if self._factor > 1 else 0

    def run(self, u: FloatArray, y: FloatArray, okay: BoolArray) -> Decimated:
        """Take a block of samples; the block may have any length, also 1.

        Parameters
        ----------
        u, y, okay : ndarray, shape (N,)
            Input, output, mask. They are not changed.

        Returns
        -------
        Decimated
            The samples kept of this block, possibly none.

        Raises
        ------
        BadShape
            If the three do not have one shape (N,).
        """
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
        """Return the state, copied."""
        return {"counters": self._counters.copy(), "level": self._level.copy(), "window": self._window.copy()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a state of a decimator with the same settings."""
        self._counters[:], self._level[:], self._window[:] = state["counters"], state["level"], state["window"]


def high_passed(record: Record, high_pass_hz: float = HIGH_PASS_HZ) -> Record:
    """Return a recording's total torque and output through the high-pass alone, at its own period; for use off line.

    Parameters
    ----------
    record : Record
        With any number of torque inputs, which are summed.
    high_pass_hz : float
        Corner of the high-pass [Hz].

    Returns
    -------
    Record
        One torque column, the same mask. What was not measured is bridged by a straight line ahead of the filter, which
        has a memory: a value held would leave a transient behind it.

    Raises
    ------
    BadSetting
        As :class:`Decimator`.
    """
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
    """Filter a recording's total torque and output and keep one in ``factor`` samples.

    Parameters
    ----------
    record : Record
        Torque inputs are summed first, as in the paper: ``u = T_M1 + T_M2``.
    factor : int
        One in ``factor`` samples is kept.
    high_pass_hz : float
        Corner of the high-pass [Hz].

    Returns
    -------
    Record
        One torque column. The filter's delay is compensated in ``time_s``, so its first samples, which are
        spoilt, lie before the recording's first.

    Raises
    ------
    BadSetting
        As :class:`Decimator`.
    """
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
