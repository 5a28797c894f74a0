"""``diagnose``: recordings and a nominal model in, a verdict out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from threadpoolctl import threadpool_limits

from estimator.diagnosis.first_use import compiled
from estimator.diagnosis.inference.answer import answer
from estimator.diagnosis.inference.hypotheses import Progress, silent
from estimator.diagnosis.preconditions.prepare import prepare
from estimator.diagnosis.result import Diagnosis
from estimator.diagnosis.thresholds import Telling
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import Work
from estimator.signals.record import Record

BUDGET_S = math.inf
"""Time after which a diagnosis is ended undecided [s]: none, so that the answer depends on no machine."""


def diagnose(
    records: Sequence[Record],
    model: DrivelineModel,
    holdout: Sequence[Record] = (),
    progress: Progress = silent,
    budget_s: float | None = None,
    effort: str = "normal",
) -> Diagnosis:
    """Find out whether physics is missing from a model, where, which, and how large it is.

    The first call on a machine compiles the simulation, in two processes, and keeps it on disk.

    Parameters
    ----------
    records : sequence of Record
        Recordings to explain, of one sampling period.
    model : DrivelineModel
        Nominal model with the tolerances its parameters are trusted to; effects it has stay as they are.
    holdout : sequence of Record, optional
        Recordings that are simulated with what was found, which no fit has seen; without them blocks of ``records``
        are kept out of one more fit. Nothing is named with which their error does not fall.
    progress : callable, optional
        Called with a message and the share of work done; an exception it raises cancels the diagnosis.
    budget_s : float, optional
        Time [s] after which the diagnosis is ended, whatever it does: nothing is decided then, and the answer says what
        was not tried. By default there is none, and the answer is the same on every machine.
    effort : {"quick", "normal", "thorough"}
        How much work the search may cost, in simulations.

    Returns
    -------
    Diagnosis
        The fields of the contract's ``diagnosis.json``, the augmented model, and simulations for plots.

    Raises
    ------
    NotExciting
        Where the recordings are too short, constant or otherwise determine nothing.
    BadShape
        Where recordings do not belong together.
    Implausible
        Where torque, output or time is off by a factor or in sign.
    """
    progress = compiled(model, records, _rising(progress))
    with threadpool_limits(1, user_api="blas"):  # on tall, thin matrices more threads only wait for each other
        progress("checking the recordings", 0.0)
        work = Work(BUDGET_S if budget_s is None else budget_s, Telling.TO_SEARCH)
        ready = prepare(records, model, holdout)
        return ready.finished(answer(ready, model, progress, effort, work))


def _rising(progress: Progress) -> Progress:
    """Report no share below an earlier one: a search begins again from another effect, or on other readings."""
    most = 0.0

    def report(message: str, share: float) -> None:
        nonlocal most
        most = max(most, share)
        progress(message, most)

    return report
