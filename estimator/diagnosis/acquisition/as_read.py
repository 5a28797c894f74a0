"""What the acquisition makes of a simulated output: the recording shows stale and rounded values, not the motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimator.diagnosis.acquisition.readings import flagged
from estimator.diagnosis.acquisition.repeated import repeated
from estimator.signals.record import FloatArray, Record


def as_read(output: FloatArray, record: Record, effects: Mapping[str, Mapping[str, float]]) -> FloatArray:
    """Return a simulated output as this recording would show it.

    Lost samples and jitter leave it as it is: what was lost is not shown, and an instant that nothing tells can't be
    reproduced (one that stamps tell is in ``record.offset_s``).

    Parameters
    ----------
    output : ndarray, shape (N,)
        Simulated output at each row.
    record : Record
        The recording that it is simulated for: tells which rows are stale.
    effects : mapping
        Effects of the model: name to parameters.
    """
    read = output
    if "speed_quantisation" in effects:
        step = effects["speed_quantisation"]["step_rad_s"]
        read = np.round(read / step) * step
    if "stale_samples" in effects:
        read = _repeating(read, record)
    return read


def _repeating(output: FloatArray, record: Record) -> FloatArray:
    """Repeat the simulated value where the recording repeats its own: the row last renewed is shown."""
    (stale,) = repeated([np.where(flagged(record), np.nan, record.output)]).rows
    renewed = np.maximum.accumulate(np.where(stale, 0, np.arange(output.size)))
    shown: FloatArray = output[renewed]
    return shown
