"""Laws without a name: at each element the best sparse sum of functions, the rival that every name must beat."""

from estimator.diagnosis.unnamed.hunt import Hunt, without_law
from estimator.diagnosis.unnamed.laws import LAGS
from estimator.diagnosis.unnamed.scene import Filter, Scene, scene
from estimator.diagnosis.unnamed.search import (
    ROUNDS,
    UnnamedLaw,
    best_of,
    best_unnamed,
    each_of,
    hunts_of,
    judged,
    unnamed_laws,
)

__all__ = [
    "LAGS",
    "ROUNDS",
    "Filter",
    "Hunt",
    "Scene",
    "UnnamedLaw",
    "best_of",
    "best_unnamed",
    "each_of",
    "hunts_of",
    "judged",
    "scene",
    "unnamed_laws",
    "without_law",
]
