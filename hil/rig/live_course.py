"""The course of an on-line estimate, kept for a file: resonance, alarms, where it ended.

Its memory does not grow with the run: a course that has become long keeps every second estimate, then every fourth, and
so on; the file says which. Alarms and states, of which there is at most one in a second, are all kept.
"""

from __future__ import annotations

import json
import math
from array import array
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from estimator.identification.tracking.alarm import TrackingState

if TYPE_CHECKING:  # the estimator takes half a second to import, and a run without an estimate has no use for it
    from estimator.identification.chain import OnlineChain, OnlineEstimate, OnlineTrajectory
    from estimator.identification.tracking.alarm import Alarm

SCHEMA = "hil.online/1"

COLUMNS = ("time_s", "resonance_hz", "resonance_std_hz", "damping", "damping_std")
"""What is kept of an estimate: 40 bytes."""

MOST_ESTIMATES = 1 << 17
"""Estimates that are kept: 44 minutes at 20 ms, and a file of 14 MB at most."""


def course_path(recording: Path) -> Path:
    """Return where the course of a run stands: next to its recording."""
    return recording.with_suffix(".online.json")


class Course:
    """What a chain said, sample by sample."""

    def __init__(self, chain: OnlineChain) -> None:
        self.samples = 0
        self._estimates, self._every = 0, 1
        self.alarms: list[Alarm] = []
        self._settings, self._filter = chain.settings, chain.L
        self._columns = {name: array("d") for name in COLUMNS}
        self._states: list[tuple[float, TrackingState]] = []
        self._last: OnlineEstimate | None = None

    def append(self, estimate: OnlineEstimate) -> None:
        """Keep one estimate."""
        mode = estimate.resonance
        frequency_hz, damping = (math.nan, math.nan) if mode is None else (mode.frequency_hz, mode.damping)
        row = (estimate.time_s, frequency_hz, estimate.frequency_std_hz, damping, estimate.damping_std)
        if self._estimates % self._every == 0:
            for column, value in zip(self._columns.values(), row, strict=True):
                column.append(value)
        self._count(1)
        if estimate.alarm is not None:
            self.alarms.append(estimate.alarm)
        self._enter(estimate.time_s, estimate.state)
        self._last = estimate

    def extend(self, block: OnlineTrajectory) -> None:
        """Keep the estimates of a block."""
        rows = (block.time_s, block.frequency_hz, block.frequency_std_hz, block.damping, block.damping_std)
        for column, values in zip(self._columns.values(), rows, strict=True):
            column.frombytes(values[-self._estimates % self._every :: self._every].tobytes())
        self._count(len(block))
        self.alarms.extend(block.alarms)
        if len(block):
            self._last = block[len(block) - 1]
        codes = block.state.tolist()
        for k, (before, code) in enumerate(pairwise((None, *codes))):
            if code != before:
                self._enter(float(block.time_s[k]), TrackingState(code))

    def _count(self, estimates: int) -> None:
        """Count estimates that were taken; keep every second one where they have become too many."""
        self._estimates += estimates
        while len(self._columns["time_s"]) >= MOST_ESTIMATES:
            self._columns = {name: column[::2] for name, column in self._columns.items()}
            self._every *= 2

    def _enter(self, time_s: float, state: TrackingState) -> None:
        """Keep when the tracking has come into another state."""
        if not self._states or self._states[-1][1] is not state:
            self._states.append((time_s, state))

    def summary(self) -> dict[str, Any]:
        """Return how it ended, and the alarms; JSON-able."""
        settings = self._settings
        return {
            "schema": SCHEMA,
            "settings": {
                "na": settings.orders.na,
                "nb": settings.orders.nb,
                "nk": settings.orders.nk,
                "sample_time_s": settings.sample_time_s,
                "high_pass_hz": settings.high_pass_hz,
                "band_hz": list(settings.band_hz),
                "adaptation": repr(settings.adaptation),
                "filter_L": None if self._filter is None else self._filter.tolist(),
            },
            "samples": self.samples,
            "estimates": self._estimates,
            "final": None if self._last is None else _final(self._last),
            "states": [{"from_s": time_s, "state": state.word} for time_s, state in self._states],
            "alarms": [alarm.as_json() for alarm in self.alarms],
        }

    def write(self, path: Path) -> None:
        """Write it all; numbers with all their digits, so that a replay can be compared to the bit."""
        columns = {name: [_number(value) for value in column] for name, column in self._columns.items()}
        text = json.dumps(self.summary() | {"every": self._every, "course": columns}, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8")

    @property
    def statement(self) -> str:
        """One line: resonance, damping and what is to be known about them."""
        if self._last is None:
            return "no estimate: the recording ended before the first one"
        return statement(self._last)

    @property
    def excitation(self) -> str:
        """One line: for how long there was no excitation; empty where there always was."""
        if self._last is None:
            return ""
        begun_s, ended_s = self._states[0][0], self._last.time_s
        spans = pairwise((*self._states, (ended_s, TrackingState.STARTING)))
        missing_s = sum(
            until_s - from_s for (from_s, state), (until_s, _) in spans if state is TrackingState.NOT_EXCITED
        )
        return f"not excited for {missing_s:.1f} of {ended_s - begun_s:.1f} s: no alarm then" if missing_s else ""


def statement(estimate: OnlineEstimate) -> str:
    """Say one estimate in a line."""
    mode, excited = estimate.resonance, estimate.state is not TrackingState.NOT_EXCITED
    why = estimate.reason if excited else f"{estimate.state.words}: {estimate.reason}"
    if mode is None:
        return f"resonance: {why or 'no lightly damped mode in the band'}"
    said = (
        f"resonance {mode.frequency_hz:.3f} Hz{_plus_minus(estimate.frequency_std_hz, 3)}, "
        f"damping {mode.damping:.4f}{_plus_minus(estimate.damping_std, 4)}"
    )
    return said if excited else f"{said}; {why}"


def _plus_minus(std: float, digits: int) -> str:
    return f" ± {1.96 * std:.{digits}f}" if math.isfinite(std) else ""


def _final(estimate: OnlineEstimate) -> dict[str, Any]:
    mode = estimate.resonance
    resonance = None
    if mode is not None:
        resonance = {
            "frequency_hz": mode.frequency_hz,
            "frequency_std_hz": _number(estimate.frequency_std_hz),
            "damping": mode.damping,
            "damping_std": _number(estimate.damping_std),
        }
    return {
        "time_s": estimate.time_s,
        "status": estimate.status.value,
        "reason": estimate.reason,
        "state": estimate.state.word,
        "theta": estimate.estimate.theta.tolist(),
        "resonance": resonance,
    }


def _number(value: float) -> float | None:
    """Return a number as JSON has it: NaN is null."""
    return value if math.isfinite(value) else None
