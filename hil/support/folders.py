"""Where this program keeps what is its own and no one's work."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def state_folder() -> Path:
    """Return the user's folder for logs: $XDG_STATE_HOME/hil, by default ~/.local/state/hil.

    On Windows %LOCALAPPDATA%/hil. It may not be there yet.
    """
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "hil"
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "hil"


def log_file() -> Path:
    """Return the newest log; older ones stand next to it as ``hil.log.1`` and so on."""
    return state_folder() / "hil.log"
