"""Runs in the environment of `tests.benchmarks.peers` that holds SIPPY: ``peers_sippy.py IN.npz OUT.npz``.

Reads u, y and the sampling period; writes numerator and denominator in z of each method's model, or why there is none.
"""

from __future__ import annotations

import sys

import numpy as np
from sippy_unipi import system_identification

ORDER, DELAY = 3, 1

METHODS = {
    "ARX": {"id_method": "ARX", "ARX_orders": [ORDER, ORDER, DELAY - 1]},
    "ARMAX": {"id_method": "ARMAX", "ARMAX_orders": [ORDER, ORDER, ORDER, DELAY - 1]},
    "output error": {"id_method": "OE", "OE_orders": [ORDER, ORDER, DELAY - 1]},
    "Box-Jenkins": {"id_method": "BJ", "BJ_orders": [ORDER, 2, 2, ORDER, DELAY - 1]},
    "N4SID": {"id_method": "N4SID", "SS_fixed_order": ORDER},
}
"""As its documentation calls them; a delay of 0 there is that of a sampled system with held input, 1 sample."""


def transfer_function(model: object) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator of the model's G in z, highest power first."""
    if hasattr(model, "NUMERATOR"):
        return np.ravel(model.G.num[0][0]), np.ravel(model.G.den[0][0])
    denominator = np.poly(model.A)
    numerator = np.poly(model.A - model.B @ model.C) + (float(model.D[0, 0]) - 1.0) * denominator
    return np.real(numerator), np.real(denominator)


def main(source: str, target: str) -> None:
    """Fit every method to the data of one file."""
    data = np.load(source)
    results = {}
    for name, options in METHODS.items():
        try:
            found = system_identification(data["y"], data["u"], tsample=float(data["sample_time_s"]), **options)
            numerator, denominator = transfer_function(found)
            results[f"{name}|num"], results[f"{name}|den"] = numerator, denominator
        except (ValueError, RuntimeError, IndexError, np.linalg.LinAlgError, SystemExit) as error:
            results[f"{name}|failed"] = np.array(f"{type(error).__name__}: {error}")
    np.savez(target, **results)


if __name__ == "__main__":
    main(*sys.argv[1:3])
