"""Versions of the FMI standard that are written."""

from __future__ import annotations

from enum import Enum


class FmiVersion(Enum):
    """Of the Functional Mock-up Interface."""

    V2 = "2.0"
    V3 = "3.0"
