"""The first use on a machine: the simulation has yet to be compiled there, which takes minutes, once.

A compiler works on one core, so two processes share the kernels. What calls a kernel takes its code in from where it is
kept on disk: first each process compiles a kernel that calls no other, then each a caller. What is quickly compiled
fills the time of the one that would be done first.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numba.core import types
from numba.core.types import boolean, float64, int64

from estimator.compiled import IS_COMPILED
from estimator.diagnosis.line.differences import Nudges, Setting, linearise
from estimator.diagnosis.line.kalman import Chain, Filtered, run_filter, run_smoother
from estimator.physics.bounded import least
from estimator.physics.kernel.integration import integrate
from estimator.physics.kernel.many import integrate_each
from estimator.physics.kernel.side_by_side import integrate_side_by_side

COMPILING = "compiling, once on this machine: some minutes"

_ROW, _ROWS, _STACK, _INDICES = float64[::1], float64[:, ::1], float64[:, :, ::1], int64[::1]
_GRID = (int64, float64, int64, float64)
_fields: Any = types.NamedTuple
_SETTING = _fields((*_GRID, _ROW, int64, boolean, _ROW, _ROWS), Setting)
_NUDGES = _fields((_INDICES, _ROW, float64), Nudges)
_EACH = (_ROWS, _ROWS, _INDICES, _INDICES, _ROW, _ROWS, _ROWS, int64, boolean, _ROWS)
_CHAIN = _fields((_STACK, _ROWS, _ROWS, _ROW, float64, float64), Chain)
_FILTERED = _fields((_ROWS, _STACK, _ROWS, _ROW, _ROW), Filtered)

SIGNATURES: dict[Any, tuple[Any, ...]] = {
    integrate: (*_GRID, int64, float64, _ROW, _ROW, _ROW, _ROW, _ROW, int64, boolean, _ROW, _ROWS),
    integrate_side_by_side: (*_GRID, int64, float64, _INDICES, *_EACH),
    integrate_each: (*_GRID, float64, *_EACH, _STACK, _INDICES),
    linearise: (_SETTING, _NUDGES, _ROW, _ROW, _ROW, _ROW, _ROW, int64, int64),
    least: (_ROWS, _ROW, _ROW, _ROW, int64, int64),
    run_filter: (_CHAIN, _ROW, _ROW, float64, _ROWS, _FILTERED),
    run_smoother: (_CHAIN, _FILTERED, _ROWS, _ROW),
}
"""The types that a diagnosis calls the largest kernels with."""

SIDE_BY_SIDE: tuple[tuple[tuple[Any, ...], tuple[Any, ...]], ...] = (
    ((integrate,), (integrate_side_by_side,)),
    ((integrate_each,), (linearise, least, run_filter, run_smoother)),
)
"""What one process compiles while the other does, callers last."""


def is_first_use() -> bool:
    """Tell whether no compiled simulation has been kept on disk yet for this version in this place.

    The same version installed in another place keeps its own.
    """
    if not IS_COMPILED:
        return False
    dispatcher: Any = integrate_each
    kept = Path(dispatcher.stats.cache_path).glob(f"many.{integrate_each.__name__}-*.nbi")
    return not any(kept)


def compile_kernels() -> None:
    """Compile the largest kernels in two processes and keep them on disk; what fails there is compiled when called.

    Not in this one: a compiler that is interrupted ends in an error of its own.
    """
    for some, others in SIDE_BY_SIDE if sys.executable else ():
        with _compiling(some), _compiling(others):
            pass


def compile_named(*names: str) -> None:
    """Compile the kernels of these names, in their order, and keep them on disk."""
    named = {kernel.__name__: kernel for kernel in SIGNATURES}
    for name in names:
        named[name].compile(SIGNATURES[named[name]])


@contextmanager
def _compiling(kernels: Sequence[Any]) -> Iterator[None]:
    """Compile kernels in a process of their own meanwhile, and wait for it; whoever is interrupted ends it."""
    names = [kernel.__name__ for kernel in kernels]
    program = f"from estimator.diagnosis.first_use import compile_named; compile_named(*{names!r})"
    with (
        tempfile.TemporaryDirectory(prefix="hil-compiling-") as folder,
        # -P: else Python would look for modules in the working folder, which may hold anybody's
        subprocess.Popen([sys.executable, "-P", "-c", program], cwd=folder, stderr=subprocess.DEVNULL) as process,
    ):
        try:
            yield
            process.wait()
        finally:
            process.kill()
