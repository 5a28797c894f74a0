"""What is asked of recordings and model before anything is fitted: refused, mended with a warning, or passed on."""

from estimator.diagnosis.preconditions.prepare import (
    FEWEST_SAMPLES,
    Prepared,
    as_moved,
    prepare,
    require_plausible_alone,
)
from estimator.diagnosis.preconditions.thinned import thin
from estimator.diagnosis.preconditions.units import are_whole_numbers, require_plausible_units

__all__ = [
    "FEWEST_SAMPLES",
    "Prepared",
    "are_whole_numbers",
    "as_moved",
    "prepare",
    "require_plausible_alone",
    "require_plausible_units",
    "thin",
]
