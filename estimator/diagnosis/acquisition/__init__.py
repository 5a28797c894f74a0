"""Faults of the acquisition, recognised in the raw recordings and compensated, so that mechanics can be judged."""

from estimator.diagnosis.acquisition.as_read import as_read
from estimator.diagnosis.acquisition.compensate import compensate
from estimator.diagnosis.acquisition.finding import OUTPUT, Finding, Sized
from estimator.diagnosis.acquisition.hidden_jitter import hidden_jitter, mean_shift
from estimator.diagnosis.acquisition.recognise import as_if_not_lost, recognise

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
