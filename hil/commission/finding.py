"""A finding: what was expected, what was measured, whether it is within, and what to do if not."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of a step's verdict.

    Attributes
    ----------
    what
        The quantity, in a few words.
    expected
        The limit, with its unit.
    measured
        The value, with its unit and interval.
    within
        Whether it is; None where the data don't tell, or there is no limit to keep.
    advice
        What to do where it is not within; empty where nothing need be done.
    blocking
        Whether continuing would be unsafe, or without meaning.
    """

    what: str
    expected: str
    measured: str
    within: bool | None
    advice: str = ""
    blocking: bool = False

    @property
    def stops(self) -> bool:
        """Whether the commissioning ends here."""
        return self.blocking and self.within is not True

    def as_json(self) -> dict[str, Any]:
        """Return it for the state file."""
        return asdict(self)


def stated(what: str, measured: str) -> Finding:
    """State a value that has no limit."""
    return Finding(what, "–", measured, None)
