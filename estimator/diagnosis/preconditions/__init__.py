"""What is asked of recordings and model before anything is fitted: refused, mended with a warning, or passed on."""

from estimator.diagnosis.preconditions.exciting import FEWEST_SAMPLES
from estimator.diagnosis.preconditions.prepare import Prepared, as_moved, prepare
from estimator.diagnosis.preconditions.thinned import thin
from estimator.diagnosis.preconditions.units import are_whole_numbers, require_plausible_units
from estimator.diagnosis.preconditions.without_model import require_plausible_alone

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
