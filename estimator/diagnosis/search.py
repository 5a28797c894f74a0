"""The search for what is missing, on recordings whose faults of the acquisition are compensated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from estimator.diagnosis.chain import Chain
from estimator.diagnosis.holdout import Examiner
from estimator.diagnosis.hypotheses import NOTHING, Bench, Effects, Progress, everything, open_hypotheses
from estimator.diagnosis.judgement import judge
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.result import Verdict
from estimator.diagnosis.selection import Jury, Selection, Selector
from estimator.diagnosis.weight import VISIBLE, Weight
from estimator.physics.effect import Untestable
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record


@dataclass(frozen=True, slots=True)
class Search:
    """A selection, what it was made with, and what the recordings can't tell."""

    chain: Chain
    bench: Bench
    examiner: Examiner
    floor: float
    selection: Selection
    untestable: Mapping[str, Untestable]


def search(chain: Chain, model: DrivelineModel, unseen: Sequence[Record], progress: Progress) -> Search:
    """Look for what is missing.

    Torques that were not read are estimated from the nominal fit first. Where effects are found, they are estimated
    again with these, and the search begins anew: a torque estimated with physics missing hides the rest. It begins
    anew, too, where the errors show jitter and an effect is hardly seen: such errors grow with the acceleration, and
    every test takes them for noise of one size.
    """
    least_ratio = VISIBLE if chain.torque_is_unknown else 1.0
    found = _searched(_repaired(chain, model, NOTHING), model, unseen, progress, least_ratio)
    if chain.torque_is_unknown and found.selection.chosen:
        found = _searched(_repaired(chain, model, found.selection.chosen), model, unseen, progress, least_ratio)
    if any(hardly_seen(name, found) for name in found.selection.chosen) and is_shaken(found):
        found = _searched(found.chain, model, unseen, progress, VISIBLE)
    return found


def is_shaken(found: Search) -> bool:
    """Tell whether what the chosen effects leave shows jitter that no stamp tells."""
    return found.chain.with_jitter_in(found.selection.result) is not found.chain


def hardly_seen(name: str, found: Search) -> bool:
    """Tell whether a chosen effect lowers the error by less than can be seen."""
    result = found.selection.result
    return found.bench.fit(found.selection.chosen - {name}, result).rms < VISIBLE * result.rms


def _repaired(chain: Chain, model: DrivelineModel, effects: Effects) -> Chain:
    """Return a chain with torques that were not read estimated from a fit with these effects."""
    if not chain.torque_is_unknown:
        return chain
    bench = Bench(model, chain.records, everything(chain.records))
    return chain.with_torques_from(bench.fit_by_steps(effects))


def _searched(
    chain: Chain, model: DrivelineModel, unseen: Sequence[Record], progress: Progress, least_ratio: float
) -> Search:
    bench = Bench(model, chain.records, everything(chain.records))
    examiner = Examiner(model, chain.records, unseen)
    floor = noise_floor(chain.records)
    names, untestable = open_hypotheses(model, chain.records)
    weight = Weight(floor, least_ratio)
    selector = Selector(Jury(bench, examiner, names, weight), progress)
    selection = selector.run()
    doubted = judge(selection, floor, chain.findings).verdict is Verdict.UNEXPLAINED
    if doubted or selector.may_imitate(selection):
        selection = selector.by_other_ways(selection)
    return Search(chain, bench, examiner, floor, selection, untestable)
