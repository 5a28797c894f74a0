"""Refuse recordings of this rig whose cycles were too uneven to identify from.

A single late or missing sample is flagged and left out. That does not help where so many are that hardly a stretch
between two of them is whole: the torque of a flagged sample is held, which is wrong by a step of the PRBS half of the
time, and the driveline rings on from it. With one bad cycle in 20 such a stretch is 20 cycles long on average, which
is what the default model (four coefficients at twice the period) needs twice over to forget where it began; beyond
that a model would tell of the gaps. A diagnosis refuses nothing: the acquisition is among what it looks into.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hil.errors import RecordingError
from hil.parse_json import parse_json
from hil.recording.formats import read_metadata

WORST_SHARE = 0.05
"""Part of the cycles that may have been late, missing or without an answer."""


def require_even_cycles(paths: Iterable[Path]) -> None:
    """See that the runs that left a timing record kept their cycles; a recording without one passes."""
    for path in paths:
        if "timing" in (metadata := read_metadata(path)):
            _require_even(path, metadata["timing"])


def _require_even(path: Path, text: str) -> None:
    try:
        timing = parse_json(text)
        cycles, missed = int(timing["cycles"]), int(timing["missed"])
        late, unanswered = int(timing["late"]), int(timing["unanswered"])
    except (ValueError, TypeError, KeyError) as error:
        raise RecordingError(
            path, f"metadata timing: expected a record hil.timing/1, got one that can't be read ({error!r})"
        ) from error
    bad, due = missed + late + unanswered, cycles + missed
    if bad > WORST_SHARE * due:
        raise RecordingError(
            path,
            f"expected at most {WORST_SHARE:.0%} of the cycles late or incomplete, got {bad / due:.0%} of {due}: "
            f"{missed} missed, {late} late by more than half a period, {unanswered} answers missing. Record again "
            "on a machine that is less busy or grants real-time scheduling, or at a longer period.",
        )
