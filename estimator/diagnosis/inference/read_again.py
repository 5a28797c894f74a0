"""Recordings read again with what was found in them: jitter that no time stamp shows shows in the errors of a fit.

Such errors grow with the acceleration. What they are in the mean is taken off the readings, and the search is made once
more.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from estimator.diagnosis.chain import Chain
from estimator.diagnosis.hypotheses import Progress, everything, open_hypotheses, silent
from estimator.diagnosis.inference.free_run import on_recordings
from estimator.diagnosis.inference.judge import Grounds, grounds
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.preconditions.thinned import as_slow_as_needed
from estimator.physics.model import DrivelineModel
from estimator.physics.work import Work
from estimator.signals.outputs import outputs_apart


@dataclass(frozen=True, slots=True)
class Found:
    """What a search found, and the recordings as they were read for it."""

    chain: Chain
    search: Search
    grounds: Grounds


def ignore(_search: Search) -> None:
    """Do nothing with a search that begins."""


def searched(
    chain: Chain,
    line: DrivelineModel,
    work: Work | None = None,
    most: float = math.inf,
    watch: Callable[[Search], None] = ignore,
    progress: Progress = silent,
) -> Found:
    """Search for what is missing; once more where the errors of what is found show jitter."""

    def begun(of: Chain) -> Search:
        search = _search(of, line, work or Work(), most)
        search.progress = progress
        watch(search)
        return search

    found = _found(chain, begun(chain))
    if found.search.stopped:
        return found
    free = on_recordings(found.grounds.best, line, chain.apart, is_whole=True)
    steady = chain.with_jitter_in(free.first_outputs())
    return found if steady is chain else _found(steady, begun(steady))


def _search(chain: Chain, line: DrivelineModel, work: Work, most: float) -> Search:
    fitted_to = outputs_apart(as_slow_as_needed(chain.records, line), noise_floor)
    names = open_hypotheses(line, chain.records)[0]
    return Search(line, fitted_to, everything(fitted_to), names, work=work, most=most)


def _found(chain: Chain, search: Search) -> Found:
    return Found(chain, search, grounds(search))
