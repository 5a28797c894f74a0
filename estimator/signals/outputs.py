"""Recordings with several measured outputs, as a fit sees them: each output a recording, driven by the same torque.

The recordings themselves come first, then their further outputs. These share the load torque, the initial state and
the moments of events of the recording that they are of (``Record.lead``). A further output is given in units in which
its noise is as large as the first output's: so a sum of squared errors weighs each by its own noise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from estimator.signals.record import Channel, Record

Noise = Callable[[Sequence[Record]], float]


def outputs_apart(records: Sequence[Record], noise_of: Noise) -> list[Record]:
    """Return recordings with one output each."""
    alone = [replace(record, channels=()) for record in records]
    first = noise_of(alone) if any(record.channels for record in records) else 1.0
    further: list[Record] = []
    for label in labels(records):
        parts = [
            _alone(record, channel, lead)
            for record, lead in zip(records, alone, strict=True)
            for channel in record.channels
            if channel.label == label
        ]
        unit = noise_of(parts) / first
        further += [replace(part, output=part.output / unit, unit=unit) for part in parts]
    return [*alone, *further]


def labels(records: Sequence[Record]) -> list[str]:
    """Return the names of the further outputs that any of some recordings has."""
    return list(dict.fromkeys(channel.label for record in records for channel in record.channels))


def leads(records: Sequence[Record]) -> tuple[int, ...]:
    """Return where in a sequence the recording stands that each is, or is a further output of."""
    place = {id(record): i for i, record in enumerate(records)}
    return tuple(place.get(id(record.lead), i) for i, record in enumerate(records))


def by_output(records: Sequence[Record]) -> list[slice]:
    """Return where the recordings of each output stand in a sequence: of the first one, and of each further one."""
    names = [record.label for record in records]
    firsts = [i for i, name in enumerate(names) if i == 0 or name != names[i - 1]]
    return [slice(first, end) for first, end in pairwise([*firsts, len(names)])]


def _alone(record: Record, channel: Channel, lead: Record) -> Record:
    return replace(
        record,
        name=f"{record.name}:{channel.label}",
        output=np.where(channel.okay, channel.output, 0.0),
        okay=channel.okay & record.okay,
        kind=channel.kind,
        location=channel.location,
        channels=(),
        lead=lead,
        label=channel.label,
    )
