"""The line of a fit, linearised and cut into blocks: what small torques do to it, and which would explain its error."""

from estimator.diagnosis.line.blocks import DRIVES, FORCES, PLACES, Line, Place, lines, size_at
from estimator.diagnosis.line.equivalent import Explanation, Input, explain, explain_all, smooth
from estimator.diagnosis.line.motion import NO_FORCE, Force, Motion, block_mean_of, motion_of, simulated, simulated_each

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
