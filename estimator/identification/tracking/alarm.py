"""The record of an alarm: when, what, from where to where, on what evidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Level:
    """A value with the interval that holds the truth in 95 of 100 cases; unit as the quantity's name says."""

    value: float
    ci95: tuple[float, float]

    def as_json(self) -> dict[str, Any]:
        """Return the level as it stands in a file."""
        return {"value": self.value, "ci95": list(self.ci95)}


@dataclass(frozen=True, slots=True)
class Alarm:
    """One change that was found.

    Attributes
    ----------
    time_s : float
        When it was found [s].
    changed_between_s : tuple of float
        The change lies between these two moments [s].
    quantity : str
        What changed, its unit at the end: ``resonance_hz``.
    before, after : Level
        Value before and since.
    statistic, threshold : float
        The evidence, and what it had to exceed.
    false_alarms_per_hour : float
        What the threshold was made for: so many alarms an hour where nothing changes.
    """

    time_s: float
    changed_between_s: tuple[float, float]
    quantity: str
    before: Level
    after: Level
    statistic: float
    threshold: float
    false_alarms_per_hour: float

    def as_json(self) -> dict[str, Any]:
        """Return the record as it stands in a file."""
        return {
            "time_s": self.time_s,
            "changed_between_s": list(self.changed_between_s),
            "quantity": self.quantity,
            "before": self.before.as_json(),
            "after": self.after.as_json(),
            "evidence": {
                "statistic": self.statistic,
                "threshold": self.threshold,
                "false_alarms_per_hour": self.false_alarms_per_hour,
            },
        }
