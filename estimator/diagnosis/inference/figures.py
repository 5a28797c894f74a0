"""Figures of a diagnosis: free runs of what is believed, and their errors where no fit has seen them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimator.diagnosis.acquisition.chain import Chain
from estimator.diagnosis.acquisition.finding import AcquisitionFinding
from estimator.diagnosis.inference.descent import THOROUGH, descended
from estimator.diagnosis.inference.disturbances import reading_noise, whitener_of
from estimator.diagnosis.inference.hypotheses import GRADE, Effects, Hypothesis
from estimator.diagnosis.inference.trials import blocks
from estimator.diagnosis.result import Estimated, Evidence, Fit, FoundEffect, OutputFit
from estimator.diagnosis.thresholds import Intervals, Judging
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, fit, not_fitted, warm_start
from estimator.physics.free_run import simulate_foreign
from estimator.physics.model import DrivelineModel, unit
from estimator.physics.problem import Problem, make_problem, parameters, start_vector
from estimator.physics.unknowns import LocalBasis, Shared
from estimator.signals.correlation import effective_samples
from estimator.signals.record import BoolArray, FloatArray, OutputKind, Record, by_output

ITERATIONS = 8  # steps of a least-squares fit of what is a recording's own, which is nearly linear

DIMENSIONS = {
    OutputKind.SPEED: "speed",
    OutputKind.POSITION: "angle",
    OutputKind.FORCE: "torque",
    OutputKind.TORQUE: "torque",
    OutputKind.ACCELERATION: "acceleration",
}


def foreign_outputs(
    result: FitResult,
    model: DrivelineModel,
    records: Sequence[Record],
    use: Sequence[BoolArray],
    effects: Effects,
) -> tuple[FloatArray, ...]:
    """Simulate other recordings with a fit's parameters; only what is each recording's own is estimated."""
    return tuple(
        simulate_foreign(model, result.p, result.problem.grid, record, samples, effects)
        for record, samples in zip(records, use, strict=True)
    )


def on_recordings(
    hypothesis: Hypothesis,
    line: DrivelineModel,
    records: Sequence[Record],
    is_whole: bool,
    use: Sequence[BoolArray] | None = None,
) -> FitResult:
    """Return the free run of a hypothesis on recordings it was fitted to, at their own rate."""
    of = hypothesis.result.problem
    own = [basis.own for basis in of.local]
    problem = make_problem(line, records, of.shared, own=own, profile=GRADE in hypothesis.effects, use=use)
    own_alone = _with_own(problem, warm_start(problem, hypothesis.result))
    if is_whole:
        return own_alone
    rms = own_alone.rms
    return descended(own_alone, lambda errors: errors / rms, THOROUGH).without_derivative()


def _with_own(problem: Problem, x: FloatArray) -> FitResult:
    """Estimate initial states, load torques and courses; phases and moments stay where they are."""
    count = len(problem.shared)
    held = tuple(_held(basis, x_i) for basis, x_i in zip(problem.bases, _parts(problem, x), strict=True))
    alone = replace(problem, p=parameters(problem, x), shared=(), local=tuple(held[lead] for lead in problem.leads))
    own = fit(alone, x[count:], ITERATIONS)
    return FitResult(problem, np.concatenate([x[:count], own.x]), own.outputs, own.residual, None, own.converged)


def _parts(problem: Problem, x: FloatArray) -> list[FloatArray]:
    ends = np.cumsum([basis.guess.size for basis in problem.bases])[:-1]
    return list(np.split(x[len(problem.shared) :], ends))


def _held(basis: LocalBasis, x: FloatArray) -> LocalBasis:
    values = (float(value) for value in x[basis.own_rows])
    own = tuple(replace(u, low=v, high=v, start=v) for u, v in zip(basis.own, values, strict=True))
    return replace(basis, own=own)


@dataclass(frozen=True, slots=True)
class Unseen:
    """The samples that judge: those of recordings kept out of the fit, else blocks of the recordings themselves."""

    line: DrivelineModel  # nominal model
    chain: Chain  # of recordings kept out of every fit

    def rms(self, hypothesis: Hypothesis, whole: FitResult, is_whole: bool, seen: Chain, is_as_read: bool) -> float:
        """Return the RMS of a hypothesis' free-run error in blocks of 0.6 s every 2 s [unit of the output].

        What is between the blocks tells what is a recording's own. Without recordings kept out the hypothesis is
        fitted once more to what is between them; ``whole`` is its free run with the values of the whole fit.
        Where faults of the acquisition were recognised the readings judge: simulated ``as_read``, or as it is.
        """
        judging = self.chain if self.chain.records else seen
        records: Sequence[Record] = judging.records if self.chain.records else hypothesis.result.problem.records
        if judging.findings and not self.chain.records:
            records = seen.separated
        between = [record.okay & ~blocks(record) for record in records]
        if self.chain.records:
            outputs = foreign_outputs(whole, self.line, records, between, hypothesis.effects)
        else:
            result = hypothesis.result
            if is_whole:
                of = result.problem
                use = tuple(record.okay & ~blocks(record) for record in of.records)
                result = refitted(hypothesis, replace(of, use=use))
            outputs = on_recordings(replace(hypothesis, result=result), self.line, records, is_whole, between).outputs
        firsts = [(out, record) for out, record in zip(outputs, records, strict=True) if record.lead is None]
        inside = [blocks(record) for _, record in firsts]
        if not judging.findings:
            errors = [(out - r.output)[r.okay & held] for (out, r), held in zip(firsts, inside, strict=True)]
        elif is_as_read:
            errors = judging.errors([out for out, _ in firsts], inside)
        else:
            pairs = zip(firsts, judging.raw, inside, strict=True)
            errors = [(out - raw.output)[raw.okay & held] for (out, _), raw, held in pairs]
        return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


@dataclass(frozen=True)
class FreeRuns:
    """Free runs before and after, on the recordings at their own rate."""

    chain: Chain  # recordings of the fit, as read and as corrected
    unseen: Unseen  # samples that judge
    believed: Hypothesis  # set of effects
    is_whole: bool  # whether what is believed leaves nothing but its disturbances
    before: FitResult  # the nominal model, re-tuned
    after: FitResult  # the nominal model with the effects believed
    held_before: float  # RMS of their errors on samples that no fit has seen [unit of the output]
    held_after: float  # the same with these effects

    @cached_property
    def retuned(self) -> FitResult:
        """The nominal model, re-tuned: the recordings' first outputs."""
        return self.before.first_outputs()

    @cached_property
    def as_read(self) -> FitResult:
        """The same, re-tuned to the recordings as they were read where a fault of their acquisition matters."""
        return (
            fit(replace(self.retuned.problem, records=self.chain.raw), self.retuned.x)
            if self.chain.findings
            else self.retuned
        )

    @cached_property
    def final(self) -> FitResult:
        """The nominal model with the effects believed: the recordings' first outputs."""
        return self.after.first_outputs()


def free_runs(nothing: Hypothesis, believed: Hypothesis, is_whole: bool, chain: Chain, unseen: Unseen) -> FreeRuns:
    """Simulate the re-tuned nominal model and what is believed, which may be the same.

    The re-tuned model leaves the least that it can: an error that it need not have is no mismatch.
    """
    before = _least(on_recordings(nothing, unseen.line, chain.separated, is_whole=False), unseen.line)
    after = before if believed is nothing else on_recordings(believed, unseen.line, chain.separated, is_whole)
    matter = _that_matter(chain, after.first_outputs())
    chain, unseen = chain.only(matter), replace(unseen, chain=unseen.chain.only(matter))
    held_before = unseen.rms(nothing, before, False, chain, is_as_read=False)
    is_the_same = believed is nothing and not matter
    held_after = held_before if is_the_same else unseen.rms(believed, after, is_whole, chain, is_as_read=True)
    return FreeRuns(chain, unseen, believed, is_whole, before, after, held_before, held_after)


def of_spread(final: FitResult) -> float:
    """Return the RMS of a free run's error over the standard deviation of what was recorded, each about its mean."""
    pairs = zip(final.problem.records, final.problem.use, strict=True)
    parts = [record.output[use] for record, use in pairs]
    return final.rms / float(np.std(np.concatenate([part - part.mean() for part in parts])))


def _that_matter(chain: Chain, final: FitResult) -> set[str]:
    """Return which faults of the acquisition are reported: that add more than a trace of the squared error.

    None where the free run leaves as much as the signal itself: nothing is established then.
    """
    if of_spread(final) > Judging.CLEARLY_BELOW:
        return set()
    errors = [(out - raw.output)[raw.okay] for out, raw in zip(final.outputs, chain.raw, strict=True)]
    least = Judging.LEAST_SHARE * sum(float(error @ error) for error in errors)
    added = zip(chain.findings, chain.added_squares(final), strict=True)
    return {finding.name for finding, squares in added if squares >= least}


def _least(retuned: FitResult, line: DrivelineModel) -> FitResult:
    """Return the re-tuned model, or a fit that begins at the nominal values where that one ends lower.

    The likelihood's optimum may be far from that of the free-run error: re-tuned, a model is never worse than as given.
    """
    problem = retuned.problem
    nominal = fit(
        replace(problem, shared=tuple(_held_at_start(each) for each in problem.shared)), start_vector(problem)
    )
    if nominal.squares >= retuned.squares:
        return retuned
    initial = not_fitted(problem, nominal.x)
    return descended(initial, lambda errors: errors / initial.rms, THOROUGH).without_derivative()


def _held_at_start(unknown: Shared) -> Shared:
    return replace(unknown, low=unknown.start, high=unknown.start)


def first_figures(chain: Chain, line: DrivelineModel, nothing: Hypothesis | None) -> tuple[Fit, FitResult]:
    """Return the errors that are known where a search was ended at once: of the model as given, and re-tuned."""
    nominal = not_fitted(problem := make_problem(line, chain.separated, ()), start_vector(problem)).first_outputs()
    estimate = nominal if nothing is None else nothing.result.first_outputs()
    found = figures_without(chain, line, nothing)
    return replace(found, nominal=nominal.rms, retuned=estimate.rms, augmented=estimate.rms), estimate


def figures_without(chain: Chain, line: DrivelineModel, nothing: Hypothesis | None) -> Fit:
    """Return the errors that are known without a further simulation."""
    rms = math.nan if nothing is None else nothing.result.first_outputs().rms
    noise = math.nan if nothing is None else float(reading_noise(nothing.sizes)[0])
    of = unit(DIMENSIONS[chain.raw[0].kind], line.motion)
    return Fit(of, math.nan, rms, rms, math.nan, math.nan, noise)


def acquired(runs: FreeRuns) -> tuple[FoundEffect, ...]:
    """Return faults of the acquisition that matter."""
    chain = runs.chain
    if not chain.findings:
        return ()
    before = [(out - raw.output)[raw.okay] for out, raw in zip(runs.final.outputs, chain.raw, strict=True)]
    return acquired_effects(chain.findings, before, chain.errors(runs.final.outputs))


def figures_of(runs: FreeRuns, noise: float) -> Fit:
    """Return the RMS errors that are reported [unit of the output], all by the raw readings."""
    chain, line, retuned = runs.chain, runs.unseen.line, runs.retuned
    return Fit(
        unit=unit(DIMENSIONS[chain.raw[0].kind], line.motion),
        nominal=fit(make_problem(line, chain.raw, (), grid=retuned.problem.grid)).rms,
        retuned=rms_of(chain.only(()).errors(runs.as_read.outputs)),
        augmented=rms_of(chain.errors(runs.final.outputs)),
        holdout_retuned=runs.held_before,
        holdout_augmented=runs.held_after,
        noise_floor=noise,
        outputs=_further(runs),
    )


def acquired_effects(
    findings: Sequence[AcquisitionFinding], before: Sequence[FloatArray], after: Sequence[FloatArray]
) -> tuple[FoundEffect, ...]:
    """Return what was recognised of the acquisition as effects."""
    seen = [slice(int(0.7 * error.size), None) for error in after]
    held = [rms_of([e[rows] for e, rows in zip(errors, seen, strict=True)]) for errors in (before, after)]
    return tuple(
        FoundEffect(
            name=finding.name,
            element=EFFECTS[finding.name].element,
            statement=finding.statement,
            parameters={name: Estimated(*sized) for name, sized in finding.parameters.items()},
            time_s={},
            indistinguishable_from=(),
            evidence=Evidence(bic_gained(before, after), held[0], held[1], finding.p_value),
        )
        for finding in findings
    )


def bic_gained(before: Sequence[FloatArray], after: Sequence[FloatArray]) -> float:
    """Return by how much one more unknown betters the information criterion of errors, for those of all recordings.

    ``n_e ln(S_0/S_1) - ln n_e`` with the effective number of samples n_e of the errors ``after`` (Schwarz, Ann. Stat.
    6, 1978).
    """
    n = max(effective_samples(after), Intervals.FEWEST_SAMPLES)
    ratio = _squares(before) / max(_squares(after), np.finfo(float).tiny)
    return n * math.log(max(ratio, 1.0)) - math.log(n)


def _squares(errors: Sequence[FloatArray]) -> float:
    return float(sum(error @ error for error in errors))


def rms_of(errors: Sequence[FloatArray]) -> float:
    """Return the RMS of the errors of several recordings together."""
    return float(np.sqrt(_squares(errors) / sum(error.size for error in errors)))


def _further(runs: FreeRuns) -> tuple[OutputFit, ...]:
    """Return the errors of the outputs beyond the first one, each in its own unit."""
    problem, found = runs.after.problem, []
    for part, noise in list(zip(by_output(problem.records), reading_noise(runs.believed.sizes), strict=True))[1:]:
        record = problem.records[part.start]
        before, after = (_rms(fit, part) * record.unit for fit in (runs.before, runs.after))
        kind, at = record.kind.value, record.location.value
        si = unit(DIMENSIONS[record.kind], runs.unseen.line.motion)
        found.append(OutputFit(record.label, kind, at, si, before, after, float(noise) * record.unit))
    return tuple(found)


def _rms(fit: FitResult, part: slice) -> float:
    problem = fit.problem
    rows = zip(fit.outputs[part], problem.records[part], problem.use[part], strict=True)
    errors = np.concatenate([(output - record.output)[use] for output, record, use in rows])
    return float(np.sqrt(np.mean(errors**2)))


def refitted(hypothesis: Hypothesis, problem: Problem) -> FitResult:
    """Return the fit of a hypothesis to other samples of the same recordings, its disturbances as they are."""
    initial = not_fitted(problem, hypothesis.result.x)
    return descended(initial, whitener_of(initial, hypothesis.sizes), THOROUGH)
