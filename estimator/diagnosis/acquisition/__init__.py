"""Faults of the acquisition, recognised in the raw recordings and compensated, so that mechanics can be judged."""

from estimator.diagnosis.acquisition.chain import as_if_not_lost, as_read, compensate, recognise
from estimator.diagnosis.acquisition.finding import OUTPUT, Finding, Sized
from estimator.diagnosis.acquisition.jitter import hidden_jitter, mean_shift

__all__ = [
    "OUTPUT",
    "Finding",
    "Sized",
    "as_if_not_lost",
    "as_read",
    "compensate",
    "hidden_jitter",
    "mean_shift",
    "recognise",
]
