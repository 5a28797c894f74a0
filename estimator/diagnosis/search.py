"""The search for what is missing, on recordings whose faults of the acquisition are compensated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from estimator.diagnosis.assemble import rms_of
from estimator.diagnosis.bench import Bench
from estimator.diagnosis.chain import Chain
from estimator.diagnosis.holdout import Examiner
from estimator.diagnosis.hypotheses import NOTHING, Effects, Progress, everything, open_hypotheses
from estimator.diagnosis.judgement import Judgement, judge
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.result import Verdict
from estimator.diagnosis.selection import Jury, Selection, Selector
from estimator.diagnosis.weight import VISIBLE, Weight
from estimator.physics.effect import Untestable
from estimator.physics.fit import FitResult
from estimator.physics.grid import Grid, grid_for
from estimator.physics.model import DrivelineModel
from estimator.physics.problem import outputs_at
from estimator.signals.record import Record

FINER = 2
"""Steps of the integration in place of one where these have a part in an explanation."""

STEPS_IN_REST = 0.2
"""RMS by which finer steps may change the free run of an explanation, over what it leaves of the error. True ones
change by a tenth of it at most, most by a hundredth; a tyre that was none, so stiff that the steps' own error drew the
shape of the mismatch, changed by all of it. What leaves far more than its steps change is not for finer ones to
mend."""


@dataclass(frozen=True, slots=True)
class Search:
    """A selection, what it was made with, and what the recordings can't tell."""

    chain: Chain
    jury: Jury
    selection: Selection
    untestable: Mapping[str, Untestable]

    @property
    def judgement(self) -> Judgement:
        """The verdict, and what it rests on."""
        return judge(self.selection, self.jury.weight.floor, self.chain.findings)


def search(chain: Chain, model: DrivelineModel, unseen: Sequence[Record], progress: Progress) -> Search:
    """Look for what is missing.

    Where the steps of the integration are part of what explains the recordings, what is chosen is fitted on finer ones
    and gone on with there. Where it leaves more on these, or is not believed on either, the search begins anew on them.
    """
    grid = grid_for(model, chain.records)
    found = _search(chain, model, unseen, progress, grid)
    if _is_for_finer_steps(found.selection):
        finer = _finer(grid)
        worth = found.selection.unfinished or found.judgement.verdict is Verdict.EXPLAINED
        moved = _moved(found, progress, finer) if worth else None
        if moved is None:
            return _search(chain, model, unseen, progress, finer, last=True)
        return (
            _without_jitter(moved, model, unseen, progress, finer, last=True) if found.selection.unfinished else moved
        )
    return found


def _is_for_finer_steps(selection: Selection) -> bool:
    """Tell whether steps have a part in what a selection leaves, or had in what it was not gone on from."""
    return selection.unfinished or is_made_by_steps(selection.result)


def _moved(found: Search, progress: Progress, grid: Grid) -> Search | None:
    """Return what was found as it is on another grid; None where it does not hold there."""
    jury = replace(found.jury, bench=found.jury.bench.on(grid))
    selector = Selector(jury, progress)
    selection = selector.taken_over(found.selection) if found.selection.chosen else None
    if selection is None:
        return None
    moved = replace(found, jury=jury, selection=selection)
    if found.selection.unfinished:
        return _by_other_ways(moved, selector) if _is_in_doubt(moved, selector) else moved
    return moved if moved.judgement.verdict is found.judgement.verdict else None


def is_made_by_steps(result: FitResult) -> bool:
    """Tell whether the free run of a fit would be another on finer steps."""
    problem = replace(result.problem, grid=_finer(result.problem.grid))
    changes = [
        (finer - output)[rows]
        for finer, output, rows in zip(outputs_at(problem, result.x), result.outputs, problem.use, strict=True)
    ]
    return rms_of(changes) > STEPS_IN_REST * result.rms


def _finer(grid: Grid) -> Grid:
    return replace(grid, substeps=FINER * grid.substeps)


def _search(
    chain: Chain, model: DrivelineModel, unseen: Sequence[Record], progress: Progress, grid: Grid, last: bool = False
) -> Search:
    """Look for what is missing, on one grid; ``last`` where none is gone to from there.

    Torques that were not read are estimated from the nominal fit first. Where effects are found, they are estimated
    again with these, and the search begins anew: a torque estimated with physics missing hides the rest. It begins
    anew, too, where the errors show jitter, without what that adds in the mean, and for what can be seen only: such
    errors grow with the acceleration, and every test takes them for noise of one size.
    """
    least_ratio = VISIBLE if chain.torque_is_unknown else 1.0
    found = _searched(_repaired(chain, model, NOTHING, grid), model, unseen, progress, grid, least_ratio, last)
    if chain.torque_is_unknown and found.selection.chosen:
        again = _repaired(chain, model, found.selection.chosen, grid)
        found = _searched(again, model, unseen, progress, grid, least_ratio, last)
    if found.selection.unfinished:  # what another effect leaves is no jitter: that is looked for on finer steps
        return found
    return _without_jitter(found, model, unseen, progress, grid, last)


def _without_jitter(
    found: Search, model: DrivelineModel, unseen: Sequence[Record], progress: Progress, grid: Grid, last: bool
) -> Search:
    """Search once more, without what jitter adds in the mean, where the errors show any."""
    steady = found.chain.with_jitter_in(found.selection.result)
    return found if steady is found.chain else _searched(steady, model, unseen, progress, grid, VISIBLE, last)


def _repaired(chain: Chain, model: DrivelineModel, effects: Effects, grid: Grid) -> Chain:
    """Return a chain with torques that were not read estimated from a fit with these effects."""
    if not chain.torque_is_unknown:
        return chain
    bench = Bench(model, chain.records, everything(chain.records), grid)
    return chain.with_torques_from(bench.fit_by_steps(effects))


def _searched(
    chain: Chain,
    model: DrivelineModel,
    unseen: Sequence[Record],
    progress: Progress,
    grid: Grid,
    least_ratio: float,
    last: bool,
) -> Search:
    """Search once; other ways are not gone from what the steps have a part in, where finer ones come anyway."""
    bench = Bench(model, chain.records, everything(chain.records), grid)
    examiner = Examiner(model, chain.records, unseen)
    names, untestable = open_hypotheses(model, chain.records)
    weight = Weight(noise_floor(chain.records), least_ratio)
    jury = Jury(bench, examiner, names, weight)
    selector = Selector(jury, progress) if last else Selector(jury, progress, is_made_by_steps)
    found = Search(chain, jury, selector.run(), untestable)
    if _is_in_doubt(found, selector) and (last or not _is_for_finer_steps(found.selection)):
        return _by_other_ways(found, selector)
    return found


def _is_in_doubt(found: Search, selector: Selector) -> bool:
    """Tell whether other ways to begin are worth going: nothing is believed, or what is may only imitate."""
    doubted = found.judgement.verdict is Verdict.UNEXPLAINED and not found.judgement.strays
    return doubted or selector.may_imitate(found.selection)


def _by_other_ways(found: Search, selector: Selector) -> Search:
    return replace(found, selection=selector.by_other_ways(found.selection))
