"""Diagnosis: where simulation and recordings differ, which physics was left out, and whether the data carry it.

What lives here: the way from recordings and nominal model to a verdict; the decision is in `inference`. What may come
in: everything of ``estimator``; records, a model, nothing of the truth simulator.
"""

from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.result import Diagnosis, Verdict

__all__ = ["Diagnosis", "Verdict", "diagnose"]
