"""Both black boxes on a run's split: fitted to the same recordings, judged on the same samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimator.identification.linear_model import Orders
from estimator.physics.model import DrivelineModel
from estimator.signals.record import BoolArray, FloatArray, Record
from hil.proof.real.black_box.linear import fit_linear, simulate_linear
from hil.proof.real.black_box.series import Stretch, spread, stretches
from hil.proof.real.black_box.sparse import PySindyMissing, fit_sparse, simulate_sparse
from hil.proof.real.case_file import Measure
from hil.proof.real.measure import error_of
from hil.proof.real.result import BlackBoxFigure

SHORTEST_TO_FIT = 50
"""Good samples of a stretch that is fitted: several times what the linear model's own unknowns take."""

SHORTEST_TO_RUN = Orders().n_states + 2
"""Good samples of a stretch that is simulated: more than its own unknowns."""


@dataclass(frozen=True, slots=True)
class Split:
    """What is fitted and what is judged.

    Attributes
    ----------
    records
        By name.
    fit, judged
        Names to the samples that the fit may use, and that count, shape (N,).
    seen
        Names of judged recordings to the samples that initial state and constant may be estimated from.
    """

    records: Mapping[str, Record]
    fit: Mapping[str, BoolArray]
    seen: Mapping[str, BoolArray]
    judged: Mapping[str, BoolArray]


Fit = Callable[[Sequence[Stretch]], Callable[[Stretch], FloatArray]]


def _linear(training: Sequence[Stretch]) -> Callable[[Stretch], FloatArray]:
    model = fit_linear(training)
    return lambda stretch: simulate_linear(model, stretch)


def _sparse(training: Sequence[Stretch]) -> Callable[[Stretch], FloatArray]:
    model = fit_sparse(training)
    return lambda stretch: simulate_sparse(model, stretch)


BOXES: Mapping[str, Fit] = {"linear, nA = nB = 4": _linear, "sparse regression (PySINDy)": _sparse}


def compare(split: Split, measure: Measure, model: DrivelineModel, sample_time_s: float) -> tuple[BlackBoxFigure, ...]:
    """Fit each black box and judge it.

    Parameters
    ----------
    model
        Turns an error of the speed into one of the force, the same for all.
    sample_time_s
        Sampling period of the black boxes [s].
    """
    return tuple(_one(name, fit, split, measure, model, sample_time_s) for name, fit in BOXES.items())


def _one(
    name: str, fit: Fit, split: Split, measure: Measure, model: DrivelineModel, sample_time_s: float
) -> BlackBoxFigure:
    training = [
        stretch
        for key, used in split.fit.items()
        for stretch in stretches(split.records[key], used, sample_time_s, SHORTEST_TO_FIT)
    ]
    if not training:
        return BlackBoxFigure(name, {}, f"no stretch has {SHORTEST_TO_FIT} samples of {sample_time_s:g} s")
    try:
        simulate = fit(training)
    except PySindyMissing as missing:
        return BlackBoxFigure(name, {}, str(missing))
    errors = {}
    for key, judged in split.judged.items():
        record = split.records[key]
        parts = stretches(record, split.seen[key], sample_time_s, SHORTEST_TO_RUN)
        course = spread(parts, [simulate(part) for part in parts], record.okay.size)
        there = np.isin(np.arange(record.okay.size), np.concatenate([part.rows for part in parts]))
        errors[key] = error_of(measure, record, course, judged & there, model)
    return BlackBoxFigure(name, errors)
