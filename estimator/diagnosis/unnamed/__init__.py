"""Laws without a name: at each element the best sparse sum of functions, the rival that every name must beat."""

from estimator.diagnosis.unnamed.laws import LAGS
from estimator.diagnosis.unnamed.scene import Filter, Scene, scene
from estimator.diagnosis.unnamed.search import (
    ROUNDS,
    ElementSearch,
    UnnamedLaw,
    best_of,
    best_unnamed,
    each_of,
    judged,
    searches_at,
    unnamed_laws,
    without_law,
)

__all__ = [
    "LAGS",
    "ROUNDS",
    "ElementSearch",
    "Filter",
    "Scene",
    "UnnamedLaw",
    "best_of",
    "best_unnamed",
    "each_of",
    "judged",
    "scene",
    "searches_at",
    "unnamed_laws",
    "without_law",
]
