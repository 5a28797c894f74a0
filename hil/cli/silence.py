"""``--quiet``: no tables, no progress; errors come on standard error all the same."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout

NO_TERMINAL = "TTY_COMPATIBLE"
"""By this variable, at 0, the console library takes no stream for a terminal: it draws no progress."""


def is_silent() -> bool:
    """Tell whether nothing is to be printed but errors."""
    return os.environ.get(NO_TERMINAL) == "0"


@contextmanager
def silence(wanted: bool) -> Iterator[None]:
    """Print nothing on standard output, and draw nothing, for the time of the block; do nothing if not wanted."""
    if not wanted:
        yield
        return
    before = os.environ.get(NO_TERMINAL)
    os.environ[NO_TERMINAL] = "0"
    try:
        with open(os.devnull, "w", encoding="utf-8") as nowhere, redirect_stdout(nowhere):
            yield
    finally:
        if before is None:
            del os.environ[NO_TERMINAL]
        else:
            os.environ[NO_TERMINAL] = before
