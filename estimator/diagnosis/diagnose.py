"""``diagnose``: recordings and a nominal model in, a verdict out.

prepare (`prepare`, and in it `doubtful`: is it plausible?), acquire (`with_faults_compensated`), search (`searched`),
decide (`decide`), say (`said`): each stage makes one record from those before it, and nothing goes back.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from threadpoolctl import threadpool_limits

from estimator.diagnosis.acquisition.chain import Chain, with_faults_compensated, without_acquisition_effects
from estimator.diagnosis.first_use import compiled
from estimator.diagnosis.inference.decide import Decision, decide
from estimator.diagnosis.inference.figures import Unseen
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import Progress, silent
from estimator.diagnosis.inference.search import Search, searched
from estimator.diagnosis.preconditions.prepare import Prepared, prepare
from estimator.diagnosis.result import Diagnosis
from estimator.diagnosis.say import Basis, effort_of, said, undecided, warnings_of
from estimator.diagnosis.tables import Law, free_form, unnamed_law
from estimator.diagnosis.thresholds import Telling
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import TimeIsUp, Work, counted
from estimator.signals.record import Record

BUDGET_S = math.inf
"""Time after which a diagnosis is ended undecided [s]: none, so that the answer depends on no machine."""


@dataclass(frozen=True, slots=True)
class SearchResult:
    """What a search found, the recordings as they were read for it, and what was decided."""

    chain: Chain  # recordings, and the faults of their acquisition
    search: Search  # the way to the best set
    decision: Decision  # what is believed of it
    law: Law | None  # one without a name, next to it


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
    progress = _rising(progress)
    progress = compiled(model, records, progress)
    with threadpool_limits(1, user_api="blas"):  # on tall, thin matrices more threads only wait for each other
        progress("checking the recordings", 0.0)
        work = Work(BUDGET_S if budget_s is None else budget_s, Telling.TO_SEARCH)
        ready = prepare(records, model, holdout)
        return ready.finished(answer(ready, model, progress, effort, work))


def answer(
    ready: Prepared,
    model: DrivelineModel,
    progress: Progress,
    level: str,
    work: Work,
    keep: Callable[[SearchResult], None] = lambda _found: None,
) -> Diagnosis:
    """Return the diagnosis of recordings that are fit for one; undecided where the limit of time ends it.

    ``keep`` is given what was found and decided, for those who continue with it.
    """
    began = time.perf_counter()
    line, chain = without_acquisition_effects(model), with_faults_compensated(ready.records)
    started: list[Fits] = []
    with counted(work):
        try:
            read, search = searched(chain, line, work, Telling.LEVELS[level], started.append, progress)
            progress("weighing what was found", 0.8)
            decision = decide(search, read, Unseen(line, with_faults_compensated(ready.holdout)), free_form)
            progress("simulating what was found", 0.9)
            effort, warnings = effort_of(search, level, decision), warnings_of(search, level)
            law = unnamed_law(decision)
            keep(SearchResult(read, search, decision, law))
            diagnosis = said(Basis(decision, search, model, effort, warnings, law, ready.doubts))
        except TimeIsUp:
            diagnosis = undecided(started[-1] if started else None, chain, line, model, work, level, ready.doubts)
    progress("done", 1.0)
    return replace(diagnosis, timing_s={"total": time.perf_counter() - began})


def _rising(progress: Progress) -> Progress:
    """Report no share below an earlier one: a search begins again from another effect, or on other readings."""
    most = 0.0

    def report(message: str, share: float) -> None:
        nonlocal most
        most = max(most, share)
        progress(message, most)

    return report
