"""Compile with numba, with a disk cache that no changed file of this package can outlive.

numba watches the file of the compiled function alone, not the files of what it calls; so the cache folder
carries a digest of every source file here.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import config as numba_config

Function = TypeVar("Function", bound=Callable[..., Any])


def _cache_folder() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hil"
    return str(Path(os.environ.get("NUMBA_CACHE_DIR") or cache) / f"truth-{digest.hexdigest()[:16]}")


_CACHE_FOLDER = _cache_folder()
_settings: Any = numba_config  # its attributes come from the environment at run time


def compiled(function: Function) -> Function:
    """Compile a function to machine code; other users of numba keep their own cache folder."""
    before = _settings.CACHE_DIR
    _settings.CACHE_DIR = _CACHE_FOLDER
    try:
        return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy")(function))
    finally:
        _settings.CACHE_DIR = before
