"""Imports of a command that needs most of the program."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_collecting() -> Iterator[None]:
    """Keep the garbage collector from running, and leave it as it was.

    Modules are made of hundreds of thousands of objects that stay: it looks through them in vain again and again, a
    tenth of the time of such imports.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
