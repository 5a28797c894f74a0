"""Runs in the environment of `tests.benchmarks.peers` that holds SysIdentPy: ``peers_sysidentpy.py IN.npz OUT.npz``.

Reads u, y, a fresh run and the sampling period; writes numerator and denominator in z of the linear model, and for the
polynomial one, which has none, its own free run over the fresh data.
"""

from __future__ import annotations

import sys

import numpy as np
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

LAGS = 3


def fitted(u: np.ndarray, y: np.ndarray, degree: int) -> FROLS:
    """A model of the given degree with its structure selected by the tool."""
    model = FROLS(
        order_selection=True,
        n_info_values=2 * LAGS if degree == 1 else 12,
        ylag=LAGS,
        xlag=LAGS,
        info_criteria="bic",
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=degree),
    )
    model.fit(X=u, y=y)
    return model


def transfer_function(model: FROLS) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator in z: its terms are numbered 1000 + lag for y and 2000 + lag for u."""
    numerator, denominator = np.zeros(LAGS + 1), np.eye(1, LAGS + 1)[0]
    for term, value in zip(np.ravel(model.final_model), np.ravel(model.theta), strict=True):
        if term // 1000 == 1:
            denominator[term % 1000] = -value
        elif term // 1000 == 2:
            numerator[term % 1000] = value
    return numerator, denominator


def main(source: str, target: str) -> None:
    """Fit the linear and the polynomial model to the data of one file."""
    data = np.load(source)
    u, y, u_fresh, y_fresh = (data[name].reshape(-1, 1) for name in ("u", "y", "u_fresh", "y_fresh"))
    results = {}
    results["ARX, FROLS|num"], results["ARX, FROLS|den"] = transfer_function(fitted(u, y, degree=1))
    polynomial = fitted(u, y, degree=2)
    results["NARX of degree 2, FROLS|fresh"] = np.ravel(polynomial.predict(X=u_fresh, y=y_fresh))
    np.savez(target, **results)


if __name__ == "__main__":
    main(*sys.argv[1:3])
