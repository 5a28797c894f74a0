"""A recursive estimator, followed and watched, block by block of samples.

What a block says of the excitation decides what becomes of the next: it is learnt from, the estimator is held, or it
begins anew (:mod:`follow`). Blocks begin with the first sample that comes, so that samples one by one, or all at
once, are cut alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from estimator.identification.online.recursive import RecursiveEstimator, Trajectory
from estimator.identification.tracking.alarm import Alarm, Level, TrackingState
from estimator.identification.tracking.follow import Excitation, Followed, Follower
from estimator.identification.tracking.watch import ChangeWatch
from estimator.signals.record import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """What came of samples: the estimates, the resonance in them, what the tracking was doing, and the alarms."""

    estimates: Trajectory  # of every sample
    found: Followed  # the resonance in them
    state: IntArray  # (n,), values of `TrackingState`
    alarms: tuple[Alarm, ...] = ()  # raised within these samples
    alarm_at: tuple[int, ...] = ()  # sample of each alarm


class Tracker:
    """The three with their state; memory does not grow."""

    def __init__(self, estimator: RecursiveEstimator, follower: Follower, watch: ChangeWatch) -> None:
        self._estimator, self._follower, self.watch = estimator, follower, watch
        self._fresh = (estimator.state(), follower.state())
        self._drowned = 0  # how often the estimator has begun anew since the resonance was last excited for long

    def run(self, time_s: FloatArray, u: FloatArray, y: FloatArray, okay: BoolArray) -> Tracked:
        """Take samples, each array of shape (n,); n may be 0."""
        parts: list[Tracked] = []
        first = 0
        while first < u.size or not parts:
            part = slice(first, first + self._follower.to_block_end)
            parts.append(self._piece(time_s[part], u[part], y[part], okay[part]))
            first = part.stop
        return parts[0] if len(parts) == 1 else _joined(parts)

    def _piece(self, time_s: FloatArray, u: FloatArray, y: FloatArray, okay: BoolArray) -> Tracked:
        """Take samples of one block."""
        held, hidden = self._follower.excitation is Excitation.LACKING, self._learns_noise
        state = np.full(u.size, self._doing, dtype=np.int64)
        estimates = self._estimator.run(u, y, np.zeros_like(okay) if held else okay)
        found = self._follower.run(u, okay, estimates)
        self.watch.run(u, y, okay, estimates)
        alarm = None
        if u.size and self._follower.at_block_end:
            alarm = self._end_block(float(time_s[-1]), estimates.theta[-1], found)
            state[-1] = self._doing
        shown = _without_resonance(found) if hidden else found
        if alarm is None:
            return Tracked(estimates, shown, state)
        return Tracked(estimates, shown, state, (alarm,), (u.size - 1,))

    def _end_block(self, time_s: float, theta: FloatArray, found: Followed) -> Alarm | None:
        excitation = self._follower.excitation
        frequency_hz, std_hz = float(found.frequency_hz[-1]), float(found.frequency_std_hz[-1])
        frequency = Level.of(frequency_hz, std_hz) if np.isfinite(std_hz) else None
        damping, excited = float(found.damping[-1]), excitation is Excitation.EXCITED
        alarm = self.watch.end_block(time_s, theta, frequency, damping, excited)
        if excitation is Excitation.DROWNED:
            self._drowned += 1
            self._estimator.restore(self._fresh[0])
            self._follower.restore(self._fresh[1])
        elif self._follower.is_trusted:
            self._drowned = 0
        return alarm

    @property
    def _learns_noise(self) -> bool:
        """Whether there is nothing to be learnt: not after the first time, which may have been a bad moment."""
        return self._drowned > 1 and self._follower.excitation is not Excitation.EXCITED

    @property
    def _doing(self) -> TrackingState:
        excitation = self._follower.excitation
        if self._learns_noise or excitation is Excitation.LACKING:
            return TrackingState.NOT_EXCITED
        return TrackingState.STARTING if excitation is Excitation.UNKNOWN else self.watch.doing

    def state(self) -> dict[str, Any]:
        """Return the state, copied: arrays and numbers, each name with its part in front."""
        kept = {
            f"{part}.{name}": value for part, holder in self._parts.items() for name, value in holder.state().items()
        }
        return kept | {"drowned": self._drowned}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a state of a tracker with the same settings."""
        for part, holder in self._parts.items():
            own = {name.removeprefix(f"{part}."): value for name, value in state.items() if name.startswith(f"{part}.")}
            holder.restore(own)
        self._drowned = int(np.asarray(state["drowned"]))

    @property
    def _parts(self) -> dict[str, Any]:
        return {"estimator": self._estimator, "follower": self._follower, "watch": self.watch}


def _without_resonance(found: Followed) -> Followed:
    nothing = np.full(found.frequency_hz.shape, np.nan)
    return Followed(nothing, nothing, nothing, nothing, nothing)


def _joined(parts: list[Tracked]) -> Tracked:
    """Put pieces together."""
    firsts = np.cumsum([0, *(part.state.size for part in parts)]).tolist()
    estimates = _columns([part.estimates for part in parts])
    return Tracked(
        estimates=Trajectory(**estimates, extra_names=parts[0].estimates.extra_names),
        found=Followed(**_columns([part.found for part in parts])),
        state=np.concatenate([part.state for part in parts]),
        alarms=tuple(alarm for part in parts for alarm in part.alarms),
        alarm_at=tuple(first + k for first, part in zip(firsts, parts, strict=False) for k in part.alarm_at),
    )


def _columns(parts: Sequence[Trajectory] | Sequence[Followed]) -> dict[str, Any]:
    """Put the arrays of trajectories together, by name."""
    arrays = [each.name for each in fields(parts[0]) if isinstance(getattr(parts[0], each.name), np.ndarray)]
    return {name: np.concatenate([getattr(part, name) for part in parts]) for name in arrays}
