"""Recordings read again with what was found in them: torques that were not read, and jitter that no stamp shows.

Both show in the errors of a fit alone. A torque estimated with physics missing hides the rest, and jitter makes errors
that grow with the acceleration: so the search is made once more with them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from estimator.diagnosis.chain import Chain
from estimator.diagnosis.hypotheses import everything, open_hypotheses
from estimator.diagnosis.inference.free_run import on_recordings
from estimator.diagnosis.inference.likelihood import Hypothesis
from estimator.diagnosis.inference.search import Search, never
from estimator.diagnosis.inference.verdict import Grounds, grounds
from estimator.diagnosis.preconditions.thinned import as_slow_as_needed
from estimator.physics.fit import FitResult
from estimator.physics.model import DrivelineModel


@dataclass(frozen=True, slots=True)
class Found:
    """What a search found, and the recordings as they were read for it."""

    chain: Chain
    search: Search
    grounds: Grounds


def searched(chain: Chain, line: DrivelineModel, is_over: Callable[[], bool] = never) -> Found:
    """Search for what is missing, as often as the recordings are to be read again."""
    first = _search(chain, line, is_over)
    read = _repaired(chain, line, first.nothing())
    found = _found(read, line, first if read is chain else _search(read, line, is_over))
    if read is not chain and found.grounds.best.effects and not is_over():
        again = _repaired(chain, line, found.grounds.best)
        found = _found(again, line, _search(again, line, is_over))
    if is_over():
        return found
    steady = found.chain.with_jitter_in(_free_run(found.chain, line, found.grounds.best))
    return found if steady is found.chain else _found(steady, line, _search(steady, line, is_over))


def _search(chain: Chain, line: DrivelineModel, is_over: Callable[[], bool]) -> Search:
    fitted_to = as_slow_as_needed(chain.records, line)
    return Search(line, fitted_to, everything(fitted_to), open_hypotheses(line, chain.records)[0], is_over=is_over)


def _found(chain: Chain, line: DrivelineModel, search: Search) -> Found:
    return Found(chain, search, grounds(search))


def _repaired(chain: Chain, line: DrivelineModel, hypothesis: Hypothesis) -> Chain:
    """Return a chain with torques that were not read estimated from a hypothesis' error."""
    return chain.with_torques_from(_free_run(chain, line, hypothesis)) if chain.torque_is_unknown else chain


def _free_run(chain: Chain, line: DrivelineModel, hypothesis: Hypothesis) -> FitResult:
    return on_recordings(hypothesis, line, chain.records, is_whole=True)
