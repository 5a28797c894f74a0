"""What is asked of recordings and model before anything is fitted: refused, mended with a warning, or passed on."""

from estimator.diagnosis.preconditions.explanations import are_whole_numbers
from estimator.diagnosis.preconditions.prepare import (
    FEWEST_SAMPLES,
    Prepared,
    as_moved,
    prepare,
    require_plausible,
    thin,
)
from estimator.diagnosis.preconditions.units import require_plausible_alone

__all__ = [
    "FEWEST_SAMPLES",
    "Prepared",
    "are_whole_numbers",
    "as_moved",
    "prepare",
    "require_plausible",
    "require_plausible_alone",
    "thin",
]
