"""Adaptation-gain profiles as a person writes them: ``NAME`` or ``NAME:key=number,...``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Any, Final

from estimator.identification.online.adaptation import PROFILES as KINDS
from estimator.identification.online.adaptation import Adaptation
from hil.errors import UsageError

PROFILES: Final[Mapping[str, type[Any]]] = MappingProxyType(
    {re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower(): kind for kind in KINDS}
)
"""Every profile by its name."""


def profile(text: str) -> Adaptation:
    """Read a profile."""
    name, _, rest = text.partition(":")
    kind = PROFILES.get(name.strip())
    if kind is None:
        raise UsageError(f"profile {name!r}: expected one of {', '.join(PROFILES)}")
    known = [field.name for field in fields(kind)]
    values: dict[str, float] = {}
    for part in rest.split(",") if rest else ():
        key, _, number = (piece.strip() for piece in part.partition("="))
        if key not in known or key in values:
            raise UsageError(f"profile {text!r}: expected each of {', '.join(known)} at most once, got {part!r}")
        try:
            values[key] = float(number)
        except ValueError as error:
            raise UsageError(f"profile {text!r}: expected {key}=number, got {part!r}") from error
    made: Adaptation = kind(**values)
    made.law  # noqa: B018 - checks the numbers
    return made
