"""``diagnose`` by likelihood, as ``estimator.diagnosis.diagnose``: parameters, result and errors are the same."""

from __future__ import annotations

from collections.abc import Sequence

from threadpoolctl import threadpool_limits

from estimator.diagnosis.hypotheses import Progress, silent
from estimator.diagnosis.inference.answer import BUDGET_S, answer
from estimator.diagnosis.preconditions import prepare
from estimator.diagnosis.result import Diagnosis
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record


def diagnose(
    records: Sequence[Record],
    model: DrivelineModel,
    holdout: Sequence[Record] = (),
    progress: Progress = silent,
    budget_s: float = BUDGET_S,
) -> Diagnosis:
    """Find out whether physics is missing from a model, where, which, and how large it is.

    ``holdout`` takes no part in the decision, a likelihood counts each unknown's price; it is simulated with what was
    found, and the figures say how far that holds. ``budget_s`` is the time after which the best set of effects so far
    is the answer [s].
    """
    with threadpool_limits(1, user_api="blas"):  # on tall, thin matrices more threads only wait for each other
        progress("checking the recordings", 0.0)
        ready = prepare(records, model, holdout)
        return ready.finished(answer(ready, model, progress, budget_s))
