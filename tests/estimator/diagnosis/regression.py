"""Linear regressions dressed as fits: the statistics of a diagnosis on problems whose answer is in the textbook."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from estimator.physics.fit import FitResult
from estimator.physics.layout import NOMINAL, SIZE, Grid
from estimator.physics.model import Structure
from estimator.physics.problem import Problem
from estimator.physics.unknowns import LocalBasis, Shared
from estimator.signals.record import FloatArray
from tests.estimator.physics.bench import record


def regression(
    designs: Sequence[FloatArray],
    measured: Sequence[FloatArray],
    *,
    bound: float = np.inf,
    scale: float = 1.0,
    effect: str = "",
) -> FitResult:
    """Fit ``y = A x`` by least squares within ``|x| <= bound``; one design (N_i, U) and one output per recording."""
    a, y = np.vstack(list(designs)), np.concatenate(list(measured))
    x = np.clip(np.linalg.lstsq(a, y, rcond=None)[0], -bound, bound)
    records = tuple(record(np.zeros(part.size), part, name=f"run_{i}") for i, part in enumerate(measured))
    shared = tuple(Shared(effect, name, scale, -bound, bound, 0.0) for name in NOMINAL[: x.size])
    nothing = np.empty(0)
    local = tuple(
        LocalBasis(Structure.ONE_MASS, False, nothing, nothing, (), np.empty((0, r.output.size))) for r in records
    )
    problem = Problem(
        Grid(Structure.ONE_MASS, 1, 1.0), records, np.zeros(SIZE), shared, local, tuple(r.okay for r in records)
    )
    return FitResult(problem, x, tuple(design @ x for design in designs), a @ x - y, a, True)


def autoregressive(correlation: float, samples: int, rng: np.random.Generator) -> FloatArray:
    """Stationary AR(1) series of unit variance; ``correlation`` is that of neighbours."""
    gain = np.sqrt(1.0 - correlation**2)
    series: FloatArray = lfilter([gain], [1.0, -correlation], rng.standard_normal(samples + 300))[300:]
    return series
