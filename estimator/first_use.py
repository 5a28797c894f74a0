"""Whether code has yet to be compiled on this machine: that takes minutes, once."""

from __future__ import annotations

from pathlib import Path

from numba.core import config as numba_config

from estimator.compiled import IS_COMPILED

COMPILING = "compiling, once on this machine: some minutes"


def is_first_use() -> bool:
    """Tell whether no compiled code of this version has been kept on disk yet."""
    return IS_COMPILED and not any(Path(vars(numba_config)["CACHE_DIR"]).glob("*"))
