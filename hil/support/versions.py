"""Versions of everything that takes part, for whoever has to reproduce a fault."""

from __future__ import annotations

import os
import platform
import re
import sys
from importlib import metadata
from typing import Any

from hil import __version__
from hil.support.command_log import VARIABLE

DISTRIBUTION = "hil-driveline"


def versions() -> dict[str, Any]:
    """Return versions and the kind of machine; nothing of the user."""
    return {
        "hil": __version__,
        "python": sys.version,
        "platform": platform.platform(),
        "machine": platform.machine(),
        "processors": os.cpu_count(),
        "packages": _packages(),
        "environment": {name: os.environ[name] for name in (VARIABLE, "LANG", "TERM") if name in os.environ},
    }


def _packages() -> dict[str, str]:
    """Return the version of each library this program asks for, as it is installed."""
    try:
        required = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        return {DISTRIBUTION: "not installed as a package"}
    names = sorted({re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in required})
    return {name: _version(name) for name in names}


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "missing"
