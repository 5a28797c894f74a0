"""The line of a fit, linearised and cut into blocks: what small torques do to it, and which would explain its error."""

from estimator.diagnosis.line.blocks import (
    DRIVES,
    FORCES,
    NO_FORCE,
    PLACES,
    Force,
    Line,
    Motion,
    Place,
    block_mean_of,
    lines,
    motion_of,
    simulated,
    simulated_each,
    size_at,
)
from estimator.diagnosis.line.equivalent import Explanation, Input, explain, explain_all, smooth

__all__ = [
    "DRIVES",
    "FORCES",
    "NO_FORCE",
    "PLACES",
    "Explanation",
    "Force",
    "Input",
    "Line",
    "Motion",
    "Place",
    "block_mean_of",
    "explain",
    "explain_all",
    "lines",
    "motion_of",
    "simulated",
    "simulated_each",
    "size_at",
    "smooth",
]
