"""Signals averaged over blocks of samples."""

from __future__ import annotations

import numpy as np

from estimator.signals.record import BoolArray, FloatArray


def block_mean(values: FloatArray, length: int) -> FloatArray:
    """Average a signal of shape (N, ...) over blocks, shape (N // length, ...)."""
    count = values.shape[0] // length
    if length == 1:
        return values[:count]
    mean: FloatArray = values[: count * length].reshape(count, length, *values.shape[1:]).mean(axis=1)
    return mean


def block_mean_of(values: FloatArray, use: BoolArray, length: int) -> tuple[FloatArray, FloatArray]:
    """Average the samples in use over blocks: the means, 0 where there are none, and how many there are; (B,)."""
    weight = block_mean(use.astype(float), length) * length
    total = block_mean(np.where(use, values, 0.0), length) * length
    return total / np.maximum(weight, 1.0), weight
