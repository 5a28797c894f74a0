"""The first use on a machine: the simulation has yet to be compiled there, which takes minutes, once.

A compiler works on one core, so two processes share the kernels. What calls a kernel takes its code in from where it is
kept on disk: first each process compiles a kernel that calls no other, then each a caller.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numba.core import config as numba_config
from numba.core import types
from numba.core.types import boolean, float64, int64

from estimator.compiled import IS_COMPILED
from estimator.diagnosis.line.differences import Nudges, Setting, linearise
from estimator.physics.kernel.integration import integrate
from estimator.physics.kernel.many import integrate_each
from estimator.physics.kernel.side_by_side import integrate_side_by_side

COMPILING = "compiling, once on this machine: some minutes"

_ROW, _ROWS, _STACK, _INDICES = float64[::1], float64[:, ::1], float64[:, :, ::1], int64[::1]
_GRID = (int64, float64, int64, float64)
_fields: Any = types.NamedTuple
_SETTING = _fields((*_GRID, _ROW, int64, boolean, _ROW, _ROWS), Setting)
_NUDGES = _fields((_INDICES, _ROW, float64), Nudges)
_EACH = (_ROWS, _ROWS, _ROW, _ROWS, _ROWS, int64, boolean, _ROWS)

SIGNATURES: dict[Any, tuple[Any, ...]] = {
    integrate: (*_GRID, int64, float64, _ROW, _ROW, _ROW, _ROW, _ROW, int64, boolean, _ROW, _ROWS),
    integrate_side_by_side: (*_GRID, int64, float64, _INDICES, *_EACH),
    integrate_each: (*_GRID, float64, *_EACH, _STACK, _INDICES),
    linearise: (_SETTING, _NUDGES, _ROW, _ROW, _ROW, _ROW, _ROW, int64, int64),
}
"""The types that a diagnosis calls the largest kernels with."""

IN_PAIRS: tuple[tuple[Any, Any], ...] = ((integrate, integrate_side_by_side), (integrate_each, linearise))
"""Kernels that are compiled at the same time, callers last."""


def is_first_use() -> bool:
    """Tell whether no compiled simulation of this version has been kept on disk yet."""
    kept = Path(vars(numba_config)["CACHE_DIR"]).glob(f"*/many.{integrate_each.__name__}-*.nbi")
    return IS_COMPILED and not any(kept)


def compile_kernels() -> None:
    """Compile the largest kernels in two processes and keep them on disk; what fails there is compiled when called.

    Not in this one: a compiler that is interrupted ends in an error of its own.
    """
    for one, other in IN_PAIRS if sys.executable else ():
        with _compiling(one.__name__), _compiling(other.__name__):
            pass


def compile_one(name: str) -> None:
    """Compile the kernel of a name and keep it on disk."""
    for kernel, signature in SIGNATURES.items():
        if kernel.__name__ == name:
            kernel.compile(signature)


@contextmanager
def _compiling(name: str) -> Iterator[None]:
    """Compile a kernel in a process of its own meanwhile, and wait for it; whoever is interrupted ends it."""
    program = f"from estimator.diagnosis.first_use import compile_one; compile_one({name!r})"
    with subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.DEVNULL) as process:
        try:
            yield
            process.wait()
        finally:
            process.kill()
