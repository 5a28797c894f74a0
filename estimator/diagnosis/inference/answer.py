"""The answer: from recordings that are fit for a diagnosis to what is said of them.

acquire (`with_faults_compensated`), search (`searched`), decide (`decide`), say (`said`): one record each, and nothing
goes back.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from estimator.diagnosis.acquisition.chain import Chain, with_faults_compensated, without_acquisition_effects
from estimator.diagnosis.inference.decide import Decision, decide
from estimator.diagnosis.inference.figures import Unseen, on_recordings
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.free_forms import free_form
from estimator.diagnosis.inference.hypotheses import Progress, all_good_samples, open_hypotheses, silent
from estimator.diagnosis.inference.say import Basis, fitted_sets, said, undecided
from estimator.diagnosis.inference.search import Search, search_from_nothing
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.preconditions.prepare import Prepared
from estimator.diagnosis.result import Diagnosis, Effort
from estimator.diagnosis.segments import as_slow_as_needed
from estimator.diagnosis.table_answer import unnamed_law
from estimator.diagnosis.thresholds import Telling
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import TimeIsUp, Work, counted
from estimator.signals.record import separated_outputs


@dataclass(frozen=True, slots=True)
class SearchResult:
    """What a search found, the recordings as they were read for it, and what was decided."""

    chain: Chain  # recordings, and the faults of their acquisition
    search: Search  # the way to the best set
    decision: Decision  # what is believed of it


def searched(
    chain: Chain,
    line: DrivelineModel,
    work: Work | None = None,
    most: float = math.inf,
    watch: Callable[[Fits], None] = lambda _fits: None,
    progress: Progress = silent,
) -> tuple[Chain, Search]:
    """Search for what is missing; once more, on readings put right, where the errors of what is found show jitter."""

    def search_of(of: Chain) -> Search:
        fitted_to = separated_outputs(as_slow_as_needed(of.records, line), noise_floor)
        names = open_hypotheses(line, of.records)[0]
        fits = Fits(line, fitted_to, all_good_samples(fitted_to), names, work=work or Work())
        watch(fits)
        return search_from_nothing(fits, most, progress)

    search = search_of(chain)
    if search.is_cut_short:
        return chain, search
    free = on_recordings(search.best, line, chain.separated, is_whole=True)
    steady = chain.with_jitter_in(free.first_outputs())
    return (chain, search) if steady is chain else (steady, search_of(steady))


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
            keep(SearchResult(read, search, decision))
            progress("simulating what was found", 0.9)
            effort, law = _effort(search, level, decision), unnamed_law(decision)
            diagnosis = said(Basis(decision, search, model, effort, _warnings(search, level), law, ready.doubts))
        except TimeIsUp:
            diagnosis = undecided(started[-1] if started else None, chain, line, model, work, level, ready.doubts)
    progress("done", 1.0)
    return replace(diagnosis, timing_s={"total": time.perf_counter() - began})


def _effort(search: Search, level: str, decision: Decision) -> Effort:
    """Return what the search cost; ``untried`` is what looked worth a fit and had none."""
    fits, best = search.fits, decision.judged.believed.hypothesis.score
    settled = {*fits.implausible, *(name for effects in (*fits.ended, *fits.rough) for name in effects)}
    untried = tuple(name for name in fits.names if name not in settled and fits.foreseen.get(name, -math.inf) < best)
    sets = fitted_sets(fits, search.path, decision.judged)
    return Effort(level, fits.simulations, True, untried, len(fits.names), sets=sets)


def _warnings(search: Search, level: str) -> tuple[str, ...]:
    if not search.is_cut_short:
        return ()
    return (
        f"the search ended with the best set of effects so far, after the {Telling.LEVELS[level]:,} simulations of its "
        f"effort ({level}); further effects, and look-alikes of those named, were not tried. Try --effort thorough, or "
        "fewer recordings.",
    )
