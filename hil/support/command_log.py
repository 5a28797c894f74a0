"""The log of every command: what was asked for, with which version, what the libraries said, how it ended.

One file that rotates, in the user's state folder, written by every ``hil`` there is: each line carries the process. It
is for people who help; nothing of this program reads it but ``hil bugreport``.
"""

from __future__ import annotations

import logging
import os
import platform
import shlex
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import StrEnum
from io import TextIOWrapper
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Final

from platformdirs import user_state_path

from hil.errors import UsageError
from hil.support.redact import Redaction
from hil.version import __version__

DEFAULT: Final = "info"
VARIABLE: Final = "HIL_LOG"

BYTES: Final = 1_000_000
"""A log is rotated here; an ordinary command writes about 300 bytes."""

OLDER_LOGS: Final = 4
"""Older logs next to the newest."""

LOGGER: Final = logging.getLogger("hil")

OURS: Final = ("hil", "drivers", "estimator")
"""Loggers at the level asked for. Those of libraries, which tell every SDO at info, are at warning, but for debug."""

OTHERS: Final = ("", "numba")


def state_folder() -> Path:
    """Return the user's folder for logs, such as ~/.local/state/hil; it may not be there yet."""
    return user_state_path("hil", appauthor=False)


def log_file() -> Path:
    """Return the newest log; older ones stand next to it as ``hil.log.1`` and so on."""
    return state_folder() / "hil.log"


class Level(StrEnum):
    """What the log keeps: from everything, each frame on the bus included, to nothing."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"
    OFF = "off"


def level_of(given: str | None) -> str:
    """Return the level: what was given, else what the environment says, else the default."""
    source, level = ("--log-level", given) if given is not None else (VARIABLE, os.environ.get(VARIABLE) or DEFAULT)
    if level.lower() not in tuple(Level):
        raise UsageError(f"{source}: expected one of {', '.join(Level)}, got {level!r}")
    return level.lower()


@contextmanager
def logged(line: Sequence[str], level: str) -> Iterator[None]:
    """Keep the log while a command runs; whatever it raises is logged and continues its way."""
    handler = None if level == "off" else _opened(level)
    if handler is None:
        yield
        return
    before = {name: logging.getLogger(name).level for name in (*OURS, *OTHERS)}
    logging.getLogger().addHandler(handler)
    _set_levels({**dict.fromkeys(OURS, level.upper()), **_other_levels(level)})
    started_s = time.monotonic()
    try:
        _begin(line)
        yield
    except KeyboardInterrupt:
        LOGGER.info("interrupted after %.3f s", time.monotonic() - started_s)
        raise
    except BaseException as error:
        LOGGER.error("ended by %s after %.3f s", type(error).__name__, time.monotonic() - started_s, exc_info=error)
        raise
    else:
        LOGGER.info("ended after %.3f s", time.monotonic() - started_s)
    finally:
        _set_levels(before)
        logging.getLogger().removeHandler(handler)
        handler.close()


def _set_levels(levels: Mapping[str, str | int]) -> None:
    for name, level in levels.items():
        logging.getLogger(name).setLevel(level)


def _other_levels(level: str) -> dict[str, str]:
    """Return the level of the root, which the libraries have, and of one that would tell every step it takes."""
    return {"": "DEBUG" if level == "debug" else "ERROR" if level == "error" else "WARNING", "numba": "INFO"}


def _begin(line: Sequence[str]) -> None:
    LOGGER.info("hil %s", shlex.join(line))
    LOGGER.info("version %s, Python %s, %s", __version__, platform.python_version(), platform.platform())


class _OwnFile(RotatingFileHandler):
    """A log that nobody else can read, also where an older version of this program has left it readable."""

    def _open(self) -> TextIOWrapper:
        for path in Path(self.baseFilename).parent.glob(f"{Path(self.baseFilename).name}*"):
            path.chmod(0o600)
        opened = os.fdopen(os.open(self.baseFilename, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600), "ab")
        return TextIOWrapper(opened, encoding="utf-8", errors="backslashreplace", write_through=True)


class _WithoutSecrets(logging.Formatter):
    """Lines without passwords and tokens: a command line may hold them, and so may what a library says."""

    def __init__(self, form: str, times: str) -> None:
        super().__init__(form, times)
        self._redaction = Redaction()

    def format(self, record: logging.LogRecord) -> str:
        return self._redaction.secrets(super().format(record))


def _opened(level: str) -> logging.Handler | None:
    """Return the handler of the log; None, and a note, where none can be kept: no command fails for want of a log."""
    path = log_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        handler = _OwnFile(path, maxBytes=BYTES, backupCount=OLDER_LOGS, encoding="utf-8")
    except OSError as error:
        sys.stderr.write(f"note: no log is kept, {path}: {error.strerror}. Set {VARIABLE}=off to go without.\n")
        return None
    handler.setLevel(level.upper())
    form = _WithoutSecrets("%(asctime)s.%(msecs)03dZ %(process)d %(levelname)s %(name)s: %(message)s", "%FT%T")
    form.converter = time.gmtime
    handler.setFormatter(form)
    return handler
