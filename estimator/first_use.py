"""Whether the simulation has yet to be compiled on this machine: that takes minutes, once."""

from __future__ import annotations

from pathlib import Path

from numba.core import config as numba_config

from estimator.compiled import IS_COMPILED
from estimator.physics.kernel.many import integrate_each

COMPILING = "compiling, once on this machine: some minutes"


def is_first_use() -> bool:
    """Tell whether no compiled simulation of this version has been kept on disk yet."""
    kept = Path(vars(numba_config)["CACHE_DIR"]).glob(f"*/many.{integrate_each.__name__}-*.nbi")
    return IS_COMPILED and not any(kept)
