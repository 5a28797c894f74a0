"""The recursive estimator in C (``recursive_oefo.c``), compiled when it is needed."""

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from estimator.identification.linear_model import Orders
from estimator.identification.online.adaptation import GainLaw
from estimator.signals.record import BoolArray, FloatArray

SOURCE = Path(__file__).with_name("recursive_oefo.c")
WIDTH = 5  # columns after theta: prediction, two errors, used, reason

Run = Callable[[Orders, FloatArray, GainLaw, int, FloatArray, FloatArray, BoolArray], FloatArray]


@contextmanager
def compiled(*options: str) -> Iterator[Run]:
    """Compile it with ``-O3`` and more options, for the time of the block; needs a C compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise FileNotFoundError("expected gcc or cc for the C to compare with, got neither: install a C compiler")
    with TemporaryDirectory(prefix="hil-recursive-") as folder:
        library = Path(folder) / "recursive_oefo.so"
        flags = ["-O3", *options, "-Wall", "-Werror", "-shared", "-fPIC"]
        subprocess.run([compiler, *flags, "-o", str(library), str(SOURCE), "-lm"], check=True)
        yield _caller(ctypes.CDLL(str(library)).oefo_run)


def _caller(function: Callable[..., int]) -> Run:
    def run(
        orders: Orders, L: FloatArray, law: GainLaw, start_up: int, u: FloatArray, y: FloatArray, okay: BoolArray
    ) -> FloatArray:
        numbers = np.array([law.initial_gain, law.lambda1, law.lambda0, law.trace, law.alpha])
        out = np.empty((u.shape[0], orders.n_parameters + WIDTH))
        at = [ctypes.c_void_p(array.ctypes.data) for array in (L, numbers, u, y, okay, out)]
        count = ctypes.c_long(u.shape[0])
        failed = function(
            orders.na, orders.nb, orders.nk, start_up, at[0], L.shape[0], at[1], at[2], at[3], at[4], count, at[5]
        )
        if failed:
            raise ValueError(f"recursive_oefo.c has no room for the orders {orders}")
        return out

    return run
