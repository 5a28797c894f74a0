"""Diagnosis: where simulation and recordings differ, which physics was left out, and whether the data carry it."""

from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.result import Diagnosis, Verdict

__all__ = ["Diagnosis", "Verdict", "diagnose"]
