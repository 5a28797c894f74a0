"""What is asked of recordings and model before anything is fitted: refused, mended with a warning, or passed on."""

from estimator.diagnosis.preconditions.exciting import FEWEST_SAMPLES
from estimator.diagnosis.preconditions.prepare import Prepared, prepare

__all__ = ["FEWEST_SAMPLES", "Prepared", "prepare"]
