"""What speaks for the larger of two nested models: information gained and probability under the smaller one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from estimator.physics.fit import FitResult
from estimator.signals.correlation import effective_samples
from estimator.signals.record import FloatArray

VERY_STRONG = 10.0
"""A difference in BIC above this is very strong evidence (Kass and Raftery, JASA 90, 1995)."""

SMALLEST_P = 1e-300


@dataclass(frozen=True, slots=True)
class Gain:
    """What a larger model gains over a smaller one.

    Attributes
    ----------
    delta_bic : float
        Information gained, residual correlation taken into account; positive speaks for the larger model.
    p_value : float
        Probability of so large a gain if the smaller model were true, for one hypothesis.
    n_effective : float
        Independent samples the larger model's residual is worth.
    """

    delta_bic: float
    p_value: float
    n_effective: float


def residuals_by_record(result: FitResult) -> list[FloatArray]:
    """Split a fit's stacked residual into one array per recording."""
    sizes = np.cumsum([int(use.sum()) for use in result.problem.use])[:-1]
    return list(np.split(result.residual, sizes))


def gain_from_squares(before: float, after: float, added: int, unknowns: int, errors: Sequence[FloatArray]) -> Gain:
    """Compare two nested least-squares fits by their sums of squares.

    ``delta_bic = n_e ln(S_0/S_1) - q ln n_e`` with the effective number of samples n_e of the larger model's
    ``errors`` (Schwarz, Ann. Stat. 6, 1978), and the F test with the same n_e.
    """
    n = max(effective_samples(errors), unknowns + 2.0)
    ratio = before / max(after, np.finfo(float).tiny)
    if ratio <= 1.0:
        return Gain(-added * math.log(n), 1.0, n)
    f_value = (ratio - 1.0) * (n - unknowns) / added
    p_value = max(float(stats.f.sf(f_value, added, n - unknowns)), SMALLEST_P)
    return Gain(n * math.log(ratio) - added * math.log(n), p_value, n)
