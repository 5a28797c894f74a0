"""Recordings read again with what was found in them: jitter that no time stamp shows shows in the errors of a fit.

Such errors grow with the acceleration. What they are in the mean is taken off the readings, and the search is made once
more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from estimator.diagnosis.chain import Chain
from estimator.diagnosis.hypotheses import everything, open_hypotheses
from estimator.diagnosis.inference.free_run import on_recordings
from estimator.diagnosis.inference.search import Search, never
from estimator.diagnosis.inference.verdict import Grounds, grounds
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.preconditions.thinned import as_slow_as_needed
from estimator.physics.model import DrivelineModel
from estimator.signals.outputs import outputs_apart


@dataclass(frozen=True, slots=True)
class Found:
    """What a search found, and the recordings as they were read for it."""

    chain: Chain
    search: Search
    grounds: Grounds


def searched(chain: Chain, line: DrivelineModel, is_over: Callable[[], bool] = never) -> Found:
    """Search for what is missing; once more where the errors of what is found show jitter."""
    found = _found(chain, line, is_over)
    if is_over():
        return found
    free = on_recordings(found.grounds.best, line, chain.apart, is_whole=True)
    steady = chain.with_jitter_in(free.first_outputs())
    return found if steady is chain else _found(steady, line, is_over)


def _found(chain: Chain, line: DrivelineModel, is_over: Callable[[], bool]) -> Found:
    fitted_to = outputs_apart(as_slow_as_needed(chain.records, line), noise_floor)
    search = Search(line, fitted_to, everything(fitted_to), open_hypotheses(line, chain.records)[0], is_over=is_over)
    return Found(chain, search, grounds(search))
