"""Recordings faster than the line needs, thinned to what it needs: a diagnosis takes time and memory by the sample.

Only where all of them together hold more than are used: fast samples tell a little more of the noise.

The torque is averaged over the samples between two that are kept, as it acts on an inertia; the output is taken as it
was read at the kept moments. Averaging that, too, would lower its noise, but also damp what the line does: at 12 blocks
a period by 1 %, which a fit would take for a parameter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.stretches import share_of
from estimator.physics.model import DrivelineModel, Structure, natural_frequencies_rad_s
from estimator.signals.record import Record

LONGEST_S = 0.01
LONGEST_OF_RIGID_S = 0.02
"""The same where a likelihood of the samples is formed: on a millisecond's grid only an encoder's steps are seen."""

BAND_POWER = 0.99
"""Share of the power of what a joint takes that lies within its band: a joint has no mode, its motion is imposed."""

FEWEST_KEPT = 200
"""Samples of the shortest recording that are kept in any case: fewer do not carry a model with a dozen unknowns."""

TURN = 2.0 * np.pi
PER_PERIOD = 12.0
"""Samples kept per period of the line's fastest mode, at least; and one in `LONGEST_S`."""


def thinned(records: Sequence[Record], model: DrivelineModel) -> list[Record]:
    """Return recordings with as many samples as the model's fastest mode needs; those that have no more as they are.

    A joint has no mode, and its recordings differ in what they need: stretches of them are used instead.
    """
    if share_of(records) >= 1.0 or model.structure is Structure.JOINT:
        return list(records)
    return [thin(record, factor_for([record], model)) for record in records]


def as_slow_as_needed(records: Sequence[Record], model: DrivelineModel) -> list[Record]:
    """Return recordings with no more samples than the line can answer to: between them only the sensor is seen.

    Of a short one enough are kept for a model and its noise.
    """
    shortest = min(record.okay.size for record in records)
    factor = min(factor_for(records, model, LONGEST_OF_RIGID_S), max(shortest // FEWEST_KEPT, 1))
    return [thin(record, factor) for record in records]


def factor_for(records: Sequence[Record], model: DrivelineModel, longest_s: float = LONGEST_S) -> int:
    """Return one in how many samples is enough for recordings of one sampling period."""
    joint = model.structure is Structure.JOINT
    fastest_hz = max(map(_band_hz, records)) if joint else float(natural_frequencies_rad_s(model.values())[-1]) / TURN
    if fastest_hz > 0.0:
        longest_s = min(longest_s, 1.0 / (PER_PERIOD * fastest_hz))
    return max(1, int(longest_s / records[0].sample_time_s * (1.0 + 1e-9)))


def _band_hz(record: Record) -> float:
    """Return the frequency below which nearly all the power of an output is [Hz]."""
    output = np.where(record.okay, record.output, np.mean(record.output[record.okay]))
    power = np.cumsum(np.abs(np.fft.rfft(output - output.mean())) ** 2)
    index = int(np.searchsorted(power, BAND_POWER * power[-1]))
    return float(np.fft.rfftfreq(output.size, record.sample_time_s)[index])


def thin(record: Record, factor: int) -> Record:
    """Return a recording with one in ``factor`` of its samples."""
    if factor == 1:
        return record
    count = record.okay.size // factor
    kept = slice(0, count * factor, factor)
    trusted = np.asarray(_blocks(record.torque_trusted, factor).all(axis=1))
    return replace(
        record,
        sample_time_s=factor * record.sample_time_s,
        time_s=record.time_s[kept],
        torque_nm=_blocks(record.torque_nm, factor).mean(axis=1),
        output=record.output[kept],
        okay=record.okay[kept],
        torque_okay=None if record.torque_okay is None else trusted,
        offset_s=None if record.offset_s is None else record.offset_s[kept],
        imposed=None if record.imposed is None else record.imposed[kept],
        reference_nm=None if record.reference_nm is None else _blocks(record.reference_nm, factor).mean(axis=1),
        load_nm=None if record.load_nm is None else _blocks(record.load_nm, factor).mean(axis=1),
        channels=tuple(replace(each, output=each.output[kept], okay=each.okay[kept]) for each in record.channels),
    )


def _blocks(values: NDArray[Any], factor: int) -> NDArray[Any]:
    """Return values by row, shape (N,) or (N, M), in blocks of so many rows; shape (N // factor, factor) or with M."""
    count = values.shape[0] // factor
    return values[: count * factor].reshape(count, factor, *values.shape[1:])
