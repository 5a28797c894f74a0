"""The first use on a machine: the simulation has yet to be compiled there, once.

A compiler works on one core, so two processes share the kernels; what is quickly compiled fills the time of the one
that would be done first. No compiled function calls a kernel: it would take all of its code in once more. numba writes
a function when all of it is compiled: a process that is killed loses the one it was at.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numba.core import types
from numba.core.types import boolean, float64, int64

from estimator.compiled import IS_COMPILED, ROOT
from estimator.diagnosis.inference.hypotheses import Progress
from estimator.least_squares import least
from estimator.physics.driveline import InitialCondition
from estimator.physics.kernel.integration import integrate
from estimator.physics.kernel.side_by_side import integrate_side_by_side
from estimator.physics.layout import Grid, flat
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import MASSES, simulate
from estimator.signals.record import Record

COMPILING = "compiling, once on this machine, for a minute or two"

_ROW, _ROWS, _STACK, _INDICES = float64[::1], float64[:, ::1], float64[:, :, ::1], int64[::1]
_TUPLE: Any = types.UniTuple
_JOINED: Any = types.Tuple
_NOTHING: Any = _JOINED(())
_EACH = (_ROWS, _ROWS, _INDICES, _INDICES, _ROW, _ROW, _ROWS, _ROWS, _INDICES, boolean, _STACK)

SIDE_BY_SIDE: tuple[tuple[Any, ...], ...] = ((integrate,), (integrate_side_by_side, least))
"""What one process compiles while the other does."""


def compiled(model: DrivelineModel, records: Sequence[Record], progress: Progress) -> Progress:
    """Compile what a diagnosis will call, where it has yet to be; return how it reports, with a note if it was so."""
    masses = len(MASSES.get(model.structure, ()))  # of a joint on a bench there is nothing to compile
    if masses and is_first_use(masses):
        report = progress
        progress = lambda message, share: report(f"{message} ({COMPILING})", share)  # noqa: E731  what most time goes to
        progress("preparing", 0.0)
        compile_kernels(masses)
    if masses and model.laws:
        progress("compiling the model's own laws", 0.0)
        compile_laws(model, records[0].sample_time_s)
    return progress


def signatures(masses: int) -> dict[Any, tuple[Any, ...]]:
    """Return the types that a diagnosis calls the largest kernels with."""
    inertias, own = _TUPLE(int64, masses), _NOTHING
    steps = (float64, int64, float64)
    return {
        integrate: (inertias, own, *steps, int64, int64, float64, _INDICES, *_EACH, _STACK),
        integrate_side_by_side: (inertias, *steps, int64, float64, _INDICES, *_EACH),
        least: (_ROWS, _ROW, _ROW, _ROW, int64, int64),
    }


def is_first_use(masses: int) -> bool:
    """Tell whether no simulation of so many masses has been kept on disk yet for this version in this place."""
    return IS_COMPILED and not _marker(masses).exists()


def _marker(masses: int) -> Path:
    dispatcher: Any = integrate_side_by_side
    return Path(dispatcher.stats.cache_path) / f"compiled_for_{masses}"


def compile_kernels(masses: int) -> None:
    """Compile the largest kernels in two processes and keep them on disk; what fails there is compiled when called."""
    if sys.executable:
        some, others = SIDE_BY_SIDE
        with _compiling(masses, some), _compiling(masses, others):
            pass
    _marker(masses).parent.mkdir(parents=True, exist_ok=True)
    _marker(masses).touch()


def compile_laws(model: DrivelineModel, sample_time_s: float) -> None:
    """Compile the kernel with laws of the user's own by a simulation of two samples; without such laws do nothing."""
    p = flat(model)
    for law in model.laws:
        for parameter in law.law.parameters:
            p[law.places[parameter.name]] = parameter.start
    nothing = np.zeros(2)
    time_s = np.array([0.0, sample_time_s])
    record = Record("compiled", sample_time_s, time_s, nothing[:, None], nothing, nothing == 0.0)
    if model.laws:
        simulate(Grid(model.structure, 1, 1.0, model.laws), record, p, InitialCondition(0.0, 0.0, 0.0))


def compile_named(masses: int, *names: str) -> None:
    """Compile the kernels of these names, in their order, and keep them on disk."""
    named = {kernel.__name__: (kernel, signature) for kernel, signature in signatures(masses).items()}
    for name in names:
        kernel, signature = named[name]
        kernel.compile(signature)


@contextmanager
def _compiling(masses: int, kernels: Sequence[Any]) -> Iterator[None]:
    """Compile kernels in a process of their own meanwhile, and wait for it; whoever is interrupted ends it."""
    names = [kernel.__name__ for kernel in kernels]
    here = f"import sys; sys.path.insert(0, {str(ROOT)!r})"  # this program and no other that is installed next to it
    program = f"{here}; from estimator.diagnosis.first_use import compile_named; compile_named({masses}, *{names!r})"
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
