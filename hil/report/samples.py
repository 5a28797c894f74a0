"""The samples behind a figure over time, so that it can be zoomed to each of them.

A figure draws the lowest and the highest sample of every stretch (``decimate``). Next to it stand the samples as 16-bit
numbers, a scale and an offset per line: a step is 1/65000 of the line's range, and five minutes of eight lines at 1 kHz
take 6.4 MB as text. `page.js` draws from them what is in view.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from estimator.signals.record import FloatArray

GAP = -32768
"""Stands for a sample that is not there."""

LARGEST = 32700

PAGE_SAMPLES = 3_000_000
"""Samples of a page at most, of all its lines: 8 MB as text."""

EVEN = 1e-3
"""Share of a period that time stamps may be off an even raster."""


def packed(time_s: FloatArray, lines: Sequence[FloatArray], recordings: int) -> tuple[dict[str, Any], int]:
    """Return the samples of some lines for `page.js`, and one in how many is there.

    Parameters
    ----------
    time_s : ndarray, shape (N,)
    lines : sequence of ndarray, shape (N,)
        NaN is a gap.
    recordings : int
        Recordings that share the page.
    """
    most = max(PAGE_SAMPLES // max(1, recordings * len(lines)), 2)
    every = -(-time_s.size // most)
    if every > 1:  # the extremes of each stretch on an even raster of half as many stretches
        pairs = [_extremes(y, 2 * every) for y in lines]
        kept = slice(0, pairs[0].size * every, every)
        return _document(time_s[kept][: pairs[0].size], pairs), every
    return _document(time_s, lines), every


def _extremes(y: FloatArray, length: int) -> FloatArray:
    """Return the lowest and the highest sample of every stretch of this length, in the order of time."""
    count = y.size // length
    cut = y[: count * length].reshape(count, length)
    low, high = np.nan_to_num(cut, nan=np.inf).argmin(axis=1), np.nan_to_num(cut, nan=-np.inf).argmax(axis=1)
    order = np.sort(np.column_stack([low, high]), axis=1)
    return np.asarray(np.take_along_axis(cut, order, axis=1).ravel())


def _document(time_s: FloatArray, lines: Sequence[FloatArray]) -> dict[str, Any]:
    step = float(time_s[-1] - time_s[0]) / max(time_s.size - 1, 1)
    is_even = np.abs(time_s - time_s[0] - step * np.arange(time_s.size)).max(initial=0.0) <= EVEN * step
    stamps = {} if is_even else {"stamps": _base64(time_s.astype("<f8"))}
    return {"start": float(time_s[0]), "step": step, "count": time_s.size, **stamps, "lines": [_line(y) for y in lines]}


def _line(y: FloatArray) -> dict[str, Any]:
    there = np.isfinite(y)
    low, high = (float(y[there].min()), float(y[there].max())) if there.any() else (0.0, 0.0)
    middle, scale = 0.5 * (low + high), (0.5 * (high - low) / LARGEST) or 1.0
    codes = np.full(y.size, GAP, dtype="<i2")
    codes[there] = np.round((y[there] - middle) / scale)
    return {"offset": middle, "scale": scale, "codes": _base64(codes)}


def _base64(values: np.ndarray[Any, Any]) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")
