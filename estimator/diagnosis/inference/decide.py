"""The decision: from the sets of effects that were fitted to what is believed, in one place, and nothing after it.

A name is established if and only if

1. its set simulates better than every fitted set of as few laws or fewer, on samples that no fit has seen; from nothing
   on, a larger set is taken only where the simulation needs it in the place of a smaller one;
2. the set needs it: at least `LEAST_NECESSITY` of the squared error beyond the noise comes back without it, on those
   samples, whatever the scatter between their blocks (95 %);
3. no free form of a law that is there already does as well: what a law of a wrong form leaves is no second law;
4. the likelihood agrees that it is there (`LEAST_EVIDENCE`).

What is in the most probable set and not established is a possible refinement: it is listed, and is not in the model. A
general law is named in the place of its special case where what it has beyond that is needed in the same way. Nothing
at all is established that leaves about as much as the signal itself, or whose free run is no better on the recordings
as read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from estimator.diagnosis.acquisition.chain import Chain
from estimator.diagnosis.inference.descent import WHOLE, Start, covariance_of_innovations
from estimator.diagnosis.inference.figures import FreeRuns, Unseen, acquired, figures_of, free_runs, of_spread
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import GRADE, NOTHING, Catalogue, Effects, Hypothesis, is_possible
from estimator.diagnosis.inference.moves import fit_look_alikes
from estimator.diagnosis.inference.remainder import Test, tests
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.inference.trials import Standing, Trial, necessity, noise_of, tried
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.result import Fit, FoundEffect, OffNominal, Verdict
from estimator.diagnosis.thresholds import Fitting, Judging
from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import Structure
from estimator.physics.fit import not_fitted
from estimator.physics.model import DrivelineModel, parameter_unit
from estimator.physics.steps import from_their_moment

Rival = Callable[[Trial, str], Trial | None]
"""A set without a name, and the name, to that set with a free form of one of its own laws; None where it has none."""


TOO_SMALL = "too small to matter"
TOO_SHORT = "too short to be distinguished from another way of sampling"
"""Why what is established is a trace: it is in the model, since the rest is judged with it, and it is no name."""

NOT_NEEDED = "the most probable set has it, and the free run does without it as well"


def no_rival(_without: Trial, _name: str) -> Trial | None:
    """Return none: no law of the set has a free form."""
    return None


@dataclass(frozen=True, slots=True)
class Judged:
    """Which names of the sets that were fitted are established."""

    nothing: Trial  # the nominal model, re-tuned
    best: Trial  # the most probable set
    believed: Trial  # with what is established alone: the model that is reported
    named: tuple[Standing, ...] = ()  # effects that are established, the weightiest first
    traces: tuple[Standing, ...] = ()  # established, and too small to matter or to be a name of its own
    refinements: tuple[Standing, ...] = ()  # of the most probable set or a larger one, and not established
    off_nominal: tuple[OffNominal, ...] = ()  # nominal values off their sheet, which leave nothing but noise
    tried: Mapping[Effects, Trial] = field(default_factory=dict)  # all sets that were tried in free simulation
    failed: tuple[Test, ...] = ()  # what the believed set leaves that noise has not

    @property
    def noise(self) -> float:
        """The noise of the reading [unit of the output].

        Disturbances take up what is missing: where more than noise is left, it is at most what can't be predicted.
        """
        noise = noise_of(self.best.hypothesis)
        return min(noise, noise_floor(self.best.hypothesis.result.problem.records)) if self.failed else noise


@dataclass(frozen=True, slots=True)
class Decision:
    """What is believed, and what its free runs leave: everything that is said is made from this record."""

    judged: Judged  # sets compared and effects believed
    runs: FreeRuns  # free runs without and with these effects
    figures: Fit  # RMS errors of the runs, as they are reported
    acquired: tuple[FoundEffect, ...]  # faults of the acquisition that matter
    verdict: Verdict  # in one word


def decide(search: Search, chain: Chain, unseen: Unseen, rival: Rival = no_rival) -> Decision:
    """Decide what the sets say that a search has fitted; ``unseen`` has recordings kept out of every fit."""
    judged = _judged(search, rival)
    decision = _with_runs(judged, chain, unseen)
    objection = _objection(decision)
    if not objection:
        return decision
    doubted = tuple(replace(each, objection=objection) for each in (*judged.named, *judged.traces))
    nothing = judged.nothing
    judged = replace(
        judged,
        believed=nothing,
        named=(),
        traces=(),
        refinements=(*doubted, *judged.refinements),
        failed=_failed(nothing.hypothesis),
    )
    return _with_runs(judged, chain, unseen)


def _with_runs(judged: Judged, chain: Chain, unseen: Unseen) -> Decision:
    nothing, believed = judged.nothing.hypothesis, judged.believed.hypothesis
    runs = free_runs(nothing, believed, not judged.failed, chain, unseen)
    findings, left = acquired(runs), of_spread(runs.final)
    figures = figures_of(runs, judged.noise)
    verdict = verdict_of(left, bool(judged.named or findings), bool(judged.failed))
    if judged.off_nominal and verdict is Verdict.NO_MISMATCH:
        verdict = Verdict.UNEXPLAINED
    return Decision(judged, runs, figures, findings, verdict)


def verdict_of(left: float, is_named: bool, is_more_than_noise: bool) -> Verdict:
    """Return the verdict on a set that leaves an error of so much of the signal's spread (CONTRACT)."""
    if left > Judging.CLEARLY_BELOW:
        return Verdict.UNEXPLAINED
    if is_named:
        return Verdict.PARTLY_EXPLAINED if is_more_than_noise else Verdict.EXPLAINED
    return Verdict.UNEXPLAINED if is_more_than_noise else Verdict.NO_MISMATCH


def _objection(decision: Decision) -> str:
    """Return why nothing is established, whatever the sets say; "" where it may be."""
    if not decision.judged.named:
        return ""
    fit, runs = decision.figures, decision.runs
    if of_spread(runs.final) > Judging.CLEARLY_BELOW:
        return "it leaves as much as the signal itself"
    if fit.augmented < fit.retuned and fit.holdout_augmented < fit.holdout_retuned:
        return ""
    return (
        f"with it the free-run error goes from {fit.retuned:.4g} to {fit.augmented:.4g} {fit.unit}, on samples "
        f"not used for the fit from {fit.holdout_retuned:.4g} to {fit.holdout_augmented:.4g}"
    )


def _failed(hypothesis: Hypothesis) -> tuple[Test, ...]:
    return tuple(test for test in tests(hypothesis) if test.failed)


def _judged(search: Search, rival: Rival) -> Judged:
    fits, trials = search.fits, search.fits.trials
    nothing = trials.one(fits.nothing())
    failed = _failed(nothing.hypothesis)
    if not failed and not search.best.effects:
        return Judged(nothing, nothing, nothing, tried=trials.all)
    sheets = free_lines(fits)
    likely, tried = _candidates(search)
    noise = noise_of(likely.hypothesis)
    chosen = nothing
    while (larger := needed_beyond(chosen, tried, noise)) is not None:
        chosen = larger
    sheet = next((each for each in sheets if _is_rather(each, fits.model, chosen, noise)), None)
    if sheet is not None:
        off_nominal = sheet.off_nominal if sheet.leaves_noise else ()
        return Judged(nothing, likely, nothing, off_nominal=off_nominal, tried=trials.all, failed=failed)
    believed, weak = chosen, dict[str, Standing]()
    while True:
        believed = _no_more_general_than_needed(fits, believed, noise)
        standings = [_standing(name, fits, believed, noise, rival) for name in sorted(believed.effects)]
        doubted = [each for each in standings if each.objection]
        if not doubted:
            break
        weakest = min(doubted, key=lambda each: (each.necessity.least, each.evidence))
        weak[weakest.name] = weakest
        believed = trials.one(fits.without(believed.hypothesis, weakest.name))
    standings.sort(key=lambda each: -each.share)
    close = {other for each in standings for other in each.alike} | believed.effects | {*weak}
    close |= {name for name in likely.effects if close & {*EFFECTS[name].contains}}  # its special case stands for it
    possible = (_standing(name, fits, likely, noise, rival) for name in sorted(likely.effects - close))
    return Judged(
        nothing,
        likely,
        believed,
        named=tuple(each for each in standings if not each.slight),
        traces=tuple(each for each in standings if each.slight),
        refinements=(
            *reversed(weak.values()),
            *(replace(each, objection=each.objection or NOT_NEEDED) for each in possible),
        ),
        tried=trials.all,
        failed=_failed(believed.hypothesis),
    )


def _candidates(search: Search) -> tuple[Trial, list[Trial]]:
    """Return the most probable set that a search has found, and the sets that are judged, each tried."""
    fits, found = search.fits, search.best
    for name in sorted(found.effects):
        fits.without(found, name)
    fit_look_alikes(fits, found)
    tried = fits.trials.of([_from_its_moment(fits, each) for each in _nearest(fits, found)])
    return next(trial for trial in tried if trial.effects == found.effects), tried


def needed_beyond(chosen: Trial, tried: Sequence[Trial], noise: float) -> Trial | None:
    """Return the smallest set that the simulation needs in the place of another one; None where it needs none.

    It leaves at most the `LEAST_NECESSITY`-th part of the error beyond the noise that the other one leaves, and no set
    of as few laws simulates better; of several that do, the most probable.
    """
    better = [
        each
        for each in tried
        if each.size > chosen.size
        and each.hypothesis.score < chosen.hypothesis.score
        and necessity(each, chosen, noise).least >= Judging.LEAST_NECESSITY
        and not any(other.beats(each) for other in tried)
    ]
    return min(better, key=lambda each: (each.size, each.hypothesis.score, sorted(each.effects)), default=None)


def _is_rather(sheet: FreeLine, model: DrivelineModel, chosen: Trial, noise: float) -> bool:
    """Tell whether values off their sheet stand in a set's place: as few of them, or more that leave nothing but noise.

    A wrong value is more usual than a law that the model lacks: of as many, the law must clearly simulate better. More
    of them are taken as a larger set is: only where the simulation needs them.
    """
    trial = sheet.tried(model)
    if trial.size <= chosen.size:
        return not chosen.clearly_beats(trial)
    return sheet.leaves_noise and necessity(trial, chosen, noise).least >= Judging.LEAST_NECESSITY


def _nearest(fits: Fits, found: Hypothesis) -> list[Hypothesis]:
    """Return the sets worth a trial: of each size the most probable, and those that simulate best as fitted."""
    possible = [each for each in fits.ended.values() if each.is_plausible]
    chosen: dict[Effects, Hypothesis] = {each.effects: each for each in (fits.nothing(), found)}
    for size in range(1, len(found.effects) + 1):
        same = [each for each in possible if len(each.effects) == size]
        chosen |= {each.effects: each for each in sorted(same, key=lambda each: each.score)[: Judging.NEAREST]}
        chosen |= {each.effects: each for each in sorted(same, key=lambda each: each.result.squares)[: Judging.NEAREST]}
    return [each for each in chosen.values() if is_possible(each, fits.records)]


def _from_its_moment(fits: Fits, hypothesis: Hypothesis) -> Hypothesis:
    """Return a set with steps of payload or stiffness that begin inside recordings, where that is as probable."""
    turned = from_their_moment(hypothesis.result, fits.model)
    if turned is hypothesis.result:
        return hypothesis
    initial = not_fitted(turned.problem, turned.x)
    start = Start(initial, hypothesis.sizes, hypothesis.limits, hypothesis.minus_twice_log)
    found = fits.fit(hypothesis.effects, [start], WHOLE)
    return found if found.score <= hypothesis.score + Fitting.SETTLED_DEVIANCE else hypothesis


def _standing(name: str, fits: Fits, whole: Trial, noise: float, rival: Rival) -> Standing:
    """Return what speaks for an effect of a set, and the first thing that speaks against it."""
    without = fits.trials.one(fits.without(whole.hypothesis, name))
    total = float(fits.trials.one(fits.nothing()).squares.sum())
    share = min(max(float(without.squares.sum() - whole.squares.sum()) / total, 0.0), 1.0)
    needed = necessity(whole, without, noise)
    evidence = without.hypothesis.score - whole.hypothesis.score
    alike = _alike(name, fits, whole, evidence)
    slight = TOO_SMALL if share < Judging.LEAST_SHARE else "" if _is_resolved(name, fits, whole) else TOO_SHORT
    standing = Standing(name, needed, share, evidence, alike, slight=slight)
    return replace(standing, objection=_against(standing, whole, without, rival))


def _is_resolved(name: str, fits: Fits, whole: Trial) -> bool:
    """Tell whether an effect is large enough to be distinguished from another way of sampling."""
    values = whole.hypothesis.result.values_of(name)
    return name == GRADE or not EFFECTS[name].unresolved(fits.model, fits.records, values)


def _against(standing: Standing, whole: Trial, without: Trial, rival: Rival) -> str:
    """Return what speaks against a name, as the end of a sentence; "" where nothing does."""
    back = f"{standing.necessity.value:.0%}".replace("%", " %")
    if standing.necessity.least < Judging.LEAST_NECESSITY:
        return f"without it {back} of the error beyond the noise comes back, which is too little to be sure"
    if standing.evidence < Judging.LEAST_EVIDENCE:
        return f"minus twice the log-probability rises by {standing.evidence:.3g} only without it"
    free = rival(without, standing.name)
    if free is not None and not whole.clearly_beats(free):
        return "another form of a law that is there already does as well"
    return ""


def _alike(name: str, fits: Fits, whole: Trial, evidence: float) -> dict[str, Mapping[str, float]]:
    """Return the effects that are as probable in an effect's place and simulate as well, with their values there."""
    best, others = whole.hypothesis, whole.effects - {name}
    within = max(Judging.ALIKE_WITHIN, Judging.ALIKE_SHARE * evidence)
    exchanged = [
        each
        for effects, each in sorted(fits.ended.items(), key=lambda item: sorted(item[0]))
        if others <= effects and len(effects - others) == 1 and name not in effects
    ]
    near = [each for each in exchanged if each.score - best.score < within and each.is_plausible]
    as_good = [each for each in near if not whole.clearly_beats(fits.trials.one(each))]
    found = {next(iter(each.effects - others)): each for each in as_good} | {name: best}
    values = {other: each.result.values_of(other) for other, each in found.items()}
    for other in found:
        for twin in EFFECTS[other].equivalent if best.outputs == 1 else ():
            values.setdefault(twin, values[other])  # the same linear system: the same parameters
    return {other: values[other] for other in sorted({*values} - best.effects)}


def _no_more_general_than_needed(fits: Fits, whole: Trial, noise: float) -> Trial:
    """Return a set with special cases in the place of general laws whose generality it does not need."""
    total = float(fits.trials.one(fits.nothing()).squares.sum())
    for name in sorted(whole.effects):
        for special in EFFECTS[name].contains:
            simpler = fits.exchanged(whole.hypothesis, name, special)
            if simpler is None:
                continue
            trial = fits.trials.one(simpler)
            beyond = float(trial.squares.sum() - whole.squares.sum()) / total
            if necessity(whole, trial, noise).least < Judging.LEAST_NECESSITY or beyond < Judging.LEAST_SHARE:
                return _no_more_general_than_needed(fits, trial, noise)
    return whole


@dataclass(frozen=True, slots=True)
class FreeLine:
    """The nominal line with its values free."""

    hypothesis: Hypothesis  # without effects
    score: float  # that of the hypothesis, with the price of the choice among the line's values
    leaves_noise: bool  # whether what it leaves passes for noise
    off_nominal: tuple[OffNominal, ...]  # what clearly left its tolerance, the clearest first

    def tried(self, model: DrivelineModel) -> Trial:
        """Return its trial in free simulation, a value off its sheet counted as a law."""
        return tried(self.hypothesis, model, len(self.off_nominal))


def free_lines(fits: Fits) -> list[FreeLine]:
    """Fit the nominal line beyond its tolerances, one value or all of them; nothing where these hold nothing back.

    One value alone comes first where that simulates as well as all: two frictions show by their sum at a steady speed,
    and a fit of both spreads over both what is wrong with one.
    """
    nothing = fits.nothing().result
    shared = nothing.problem.shared
    trusted = {s.name for s in shared if not s.effect and np.isfinite(s.low) and s.low < s.high}
    at_bound = [s.name for s, pinned in zip(shared, nothing.pinned, strict=False) if pinned and s.name in trusted]
    if not at_bound:
        return []
    whole = _freed(fits, trusted, len(trusted))
    each_alone = (_freed(fits, {name}, len(trusted)) for name in at_bound)
    alone = min((each for each in each_alone if each is not None), key=lambda each: each.score, default=None)
    if whole is None or alone is None:
        return [each for each in (alone, whole) if each is not None]
    as_good = alone.leaves_noise or not whole.leaves_noise
    is_enough = as_good and not whole.tried(fits.model).clearly_beats(alone.tried(fits.model))
    return [alone, whole] if is_enough else [whole]


def _freed(fits: Fits, names: Collection[str], among: int) -> FreeLine | None:
    """Fit the nominal line with some of its values free; None where none of these clearly leaves its tolerance.

    They were chosen ``among`` so many.
    """
    nothing = fits.nothing().result
    shared = nothing.problem.shared
    # a joint has nothing to integrate: of its stiffness and damping, one may be none at all
    least = 0.0 if nothing.problem.grid.structure is Structure.JOINT else 1.0 / Judging.FREELY
    freed = tuple(
        replace(s, low=min(s.low, least), high=max(s.high, Judging.FREELY)) if not s.effect and s.name in names else s
        for s in shared
    )
    problem = replace(nothing.problem, shared=freed)
    start = Start(not_fitted(problem, nothing.x), fits.nothing().sizes, fits.limits, fits.nothing().minus_twice_log)
    found = fits.fit(NOTHING, [start], WHOLE)
    off_nominal = _off_nominal(fits, found, names)
    if not off_nominal:
        return None
    chosen = Catalogue(fits.model, len(fits.names) + among).choices(frozenset(each.name for each in off_nominal))
    return FreeLine(found, found.score + 2.0 * chosen, not any(test.failed for test in tests(found)), off_nominal)


def _off_nominal(fits: Fits, found: Hypothesis, freed: Collection[str]) -> tuple[OffNominal, ...]:
    """Return what has clearly left its tolerance, the clearest first.

    The standard error of one that is freed alone is that of a line whose other values are held nowhere: what it gains
    in likelihood says how clear it is (Wilks, Ann. Math. Stat. 9, 1938).
    """
    nothing = fits.nothing()
    spread = np.sqrt(np.maximum(np.diag(covariance_of_innovations(found)), np.finfo(float).tiny))
    gained = math.sqrt(max(nothing.minus_twice_log - found.minus_twice_log, 0.0))
    clear = []
    for i, trusted in enumerate(nothing.result.problem.shared):
        ratio = float(found.result.x[i])
        by = max(trusted.low - ratio, ratio - trusted.high)
        sureness = gained if len(freed) == 1 else by / float(spread[i])
        is_free = trusted.name in freed and not trusted.effect and trusted.low < trusted.high
        if is_free and by > 0.0 and sureness > Judging.CLEARLY:
            given, unit = fits.model.parameters[trusted.name], parameter_unit(trusted.name, fits.model.motion)
            clear.append((sureness, OffNominal(trusted.name, ratio, trusted.high - 1.0, given.value, unit)))
    return tuple(value for _, value in sorted(clear, key=lambda each: -each[0]))
