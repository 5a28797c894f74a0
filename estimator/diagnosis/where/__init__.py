"""Where simulation and recordings differ, and what is lacking there."""

from estimator.diagnosis.where.discrepancy import discrepancy

__all__ = ["discrepancy"]
