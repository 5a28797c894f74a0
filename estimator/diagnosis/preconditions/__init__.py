"""What is asked of recordings and model before anything is fitted: refused, mended with a warning, or passed on."""

from estimator.diagnosis.preconditions.exciting import FEWEST_SAMPLES
from estimator.diagnosis.preconditions.prepare import Prepared, as_moved, prepare
from estimator.diagnosis.preconditions.thinned import thin
from estimator.diagnosis.preconditions.units import require_plausible_units

__all__ = ["FEWEST_SAMPLES", "Prepared", "as_moved", "prepare", "require_plausible_units", "thin"]
