"""What can be started from the view."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Choice:
    """An experiment as it is offered: its name, and what it will command, in words."""

    name: str
    summary: str
