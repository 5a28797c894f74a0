"""Figures of a diagnosis: free runs of what is believed, their errors, and effects with values and intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimator.diagnosis.acquisition.chain import Chain
from estimator.diagnosis.assemble import (
    acquired_effects,
    free_unknowns,
    moments_in,
    parameters_of,
    profile_size,
    profiles_of,
    reported_covariance,
    rms_of,
)
from estimator.diagnosis.inference.descent import descended
from estimator.diagnosis.inference.disturbances import Size, reading_noise, whitener_of
from estimator.diagnosis.inference.hypotheses import (
    GRADE,
    NOTHING,
    THOROUGH,
    Effects,
    Hypothesis,
    all_good_samples,
)
from estimator.diagnosis.inference.spread import beyond_the_line, with_secants
from estimator.diagnosis.inference.trials import Standing, blocks
from estimator.diagnosis.result import Evidence, Fit, FoundEffect, OutputFit, Trace
from estimator.diagnosis.thresholds import Judging, Noise
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, fit, not_fitted, warm_start
from estimator.physics.free_run import simulate_foreign
from estimator.physics.model import DrivelineModel, unit
from estimator.physics.problem import Problem, make_problem, parameters, start_vector
from estimator.physics.unknowns import LocalBasis, Shared
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


def found_effect(standing: Standing, runs: FreeRuns) -> FoundEffect:
    """Return an effect of the believed set with its values, from the fit that is reported."""
    entry, model, best = EFFECTS[standing.name], runs.unseen.line, runs.believed.result
    nulls = {parameter.name: parameter.null for parameter in entry.parameters}
    profiles = {}
    if standing.name == GRADE:
        of = best.problem
        problem = make_problem(model, of.records, of.shared, own=[b.own for b in of.local], profile=True, use=of.use)
        course = fit(problem, warm_start(problem, best))
        of_course = reported_covariance(course)
        profiles, parameters = profiles_of(course, of_course, model), profile_size(course, of_course, model)
    else:
        parameters = parameters_of(standing.name, runs.estimate, runs.covariance, model)
    p_value = max(math.exp(-0.5 * max(standing.evidence, 0.0)), Noise.SMALLEST_P)
    return FoundEffect(
        name=entry.name,
        element=entry.element,
        statement=entry.sentence(nulls | {name: p.value for name, p in parameters.items()}, model.motion),
        parameters=parameters,
        time_s=moments_in(standing.name, runs.estimate) if entry.event else {},
        indistinguishable_from=tuple(standing.alike),
        alternatives=standing.alike,
        evidence=Evidence(standing.evidence, runs.held_before, runs.held_after, p_value),
        profiles=profiles,
        share=standing.share,
        probability=standing.probability,
        form=entry.form({name: p.value for name, p in parameters.items()}),
        necessity=standing.necessity.value,
        least_necessity=standing.necessity.least,
        counted=standing.counted,
    )


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

    @cached_property
    def estimate(self) -> FitResult:
        """The fit that values and intervals are taken from: of independent innovations, or of the free run."""
        return replace(self.believed, result=self._errors).white if self.is_whole else self._errors

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of its scaled unknowns, shape (U, U): of correlated errors, and of disturbances that grow."""
        free = free_unknowns(self.estimate)
        fitted_s, period_s = (fit.problem.records[0].sample_time_s for fit in (self.believed.result, self._errors))
        sizes = self.believed.sizes.copy()
        sizes[Size.TORQUE] += 0.5 * math.log(fitted_s / period_s)  # of one sample, where these are closer together
        return reported_covariance(self.estimate) + beyond_the_line(self._errors, self._weigh, sizes, free)

    @cached_property
    def _errors(self) -> FitResult:
        """The same fit in its plain errors, its derivative over the width of the intervals."""
        return with_secants(self.believed.result if self.is_whole else self.after, self._weigh)

    def _weigh(self, errors: FloatArray) -> FloatArray:
        """Return errors of the fit with a variance of 1."""
        return self.believed.filter(errors) if self.is_whole else errors / self.after.rms


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


def courses_of(runs: FreeRuns) -> tuple[Trace, ...]:
    """Return the simulations of every recording, for plots; those kept out of the fit last."""
    line, kept_out, grid = runs.unseen.line, runs.unseen.chain.records, runs.retuned.problem.grid

    def nominal(records: Sequence[Record]) -> tuple[FloatArray, ...]:
        return fit(make_problem(line, records, (), grid=grid)).outputs

    outputs = (nominal(runs.chain.records), runs.as_read.outputs, runs.chain.read(runs.final.outputs))
    traces = [_trace(record, each, False) for record, *each in zip(runs.chain.raw, *outputs, strict=True)]
    if kept_out:
        use = all_good_samples(kept_out)
        outputs = (
            nominal(kept_out),
            foreign_outputs(runs.retuned, line, kept_out, use, NOTHING),
            foreign_outputs(runs.final, line, kept_out, use, runs.believed.effects),
        )
        traces += [_trace(record, each, True) for record, *each in zip(kept_out, *outputs, strict=True)]
    return tuple(traces)


def _trace(r: Record, runs: Sequence[FloatArray], holdout: bool) -> Trace:
    nominal, retuned, augmented = runs
    return Trace(r.name, r.time_s, r.torque_nm, r.output, r.okay, nominal, retuned, augmented, holdout)


def refitted(hypothesis: Hypothesis, problem: Problem) -> FitResult:
    """Return the fit of a hypothesis to other samples of the same recordings, its disturbances as they are."""
    initial = not_fitted(problem, hypothesis.result.x)
    return descended(initial, whitener_of(initial, hypothesis.sizes), THOROUGH)
