"""What code of others may run."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Trust:
    """What code may run: that of a model file's own laws, and that in an FMU."""

    laws: bool = False
    fmu: bool = False
