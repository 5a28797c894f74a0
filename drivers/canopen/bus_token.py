"""The token of a bus that is served on this machine: who may read it may drive the simulated drives.

Every program of this machine, and every page in its browser, can reach a port of it. A served bus takes only those who
name its token, as the path of its URL: ``ws://127.0.0.1:54701/TOKEN/``. It is made anew for each server, and kept in a
file of the user's own, so that a rig file that names the port alone keeps working for that user.
"""

from __future__ import annotations

import os
import secrets
import sys
from pathlib import Path
from typing import Final

TOKEN_BYTES: Final = 24

LOOPBACK: Final = frozenset({"127.0.0.1", "::1", "localhost"})


def new_token() -> str:
    """Draw a token; letters, digits, ``-`` and ``_``."""
    return secrets.token_urlsafe(TOKEN_BYTES)


def token_file(port: int) -> Path:
    """Name the file of a port's token, in the user's folder of sockets or, where there is none, of states."""
    base = os.environ.get("XDG_RUNTIME_DIR") or os.environ.get("XDG_STATE_HOME")
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA")
    return Path(base or Path.home() / ".local" / "state") / "hil" / f"bus-{port}.token"


def keep_token(port: int, token: str) -> None:
    """Keep the token of a server that is up; nobody else can read it."""
    path = token_file(port)
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    path.unlink(missing_ok=True)
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as file:
        file.write(token)


def forget_token(port: int, token: str) -> None:
    """Remove the token of a server that is gone, unless the port has another one's by now."""
    if kept_token(port) == token:
        token_file(port).unlink(missing_ok=True)


def kept_token(port: int) -> str | None:
    """Return the token that is kept for a port; None where there is none."""
    try:
        return token_file(port).read_text(encoding="ascii")
    except (OSError, ValueError):
        return None
