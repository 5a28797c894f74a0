"""What the tracking of a resonance is doing."""

from __future__ import annotations

from enum import IntEnum


class TrackingState(IntEnum):
    """State of the tracking at a sample; in files and on screens it has the name in small letters."""

    STARTING = 0  # there is no resonance to be watched, yet or for a moment
    LEARNING = 1  # what is usual is being learnt; no alarm can come
    WATCHING = 2  # a change is alarmed
    SETTLING = 3  # after an alarm: the estimate is on its way
    NOT_EXCITED = 4  # the torque says nothing of the resonance: no alarm can come, and the estimate is held or none

    @property
    def word(self) -> str:
        """The state as it stands in a file."""
        return self.name.lower()

    @property
    def words(self) -> str:
        """The state as it stands in a text."""
        return self.word.replace("_", " ")
