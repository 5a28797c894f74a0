"""A result put together from a fit: effects and values with their intervals, and the model to continue with."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from estimator.diagnosis.covariance import Z95, Estimate, reported_covariance
from estimator.diagnosis.inference.descent import covariance_of_innovations
from estimator.diagnosis.inference.figures import FreeRuns
from estimator.diagnosis.inference.hypotheses import GRADE, Hypothesis
from estimator.diagnosis.inference.trials import Standing
from estimator.diagnosis.line.line import line_values
from estimator.diagnosis.result import Estimated, Evidence, FoundEffect, Interval, Profile, Retuned, Slight
from estimator.diagnosis.thresholds import Noise
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.effects.load import ROAD_GRADE, grade_basis
from estimator.physics.fit import FitResult, fit, warm_start
from estimator.physics.jacobian import STEP
from estimator.physics.layout import LOAD, slot
from estimator.physics.model import DrivelineModel, EffectValue, Parameter, parameter_dimension, parameter_unit, unit
from estimator.physics.problem import local_part, make_problem
from estimator.physics.steps import inside, moments_of
from estimator.physics.unknowns import LOAD_TORQUE, Shared
from estimator.signals.record import FloatArray

PROFILE_POINTS_S = 1.0  # a profile is reported every second


def interval(result: FitResult, cov: FloatArray, index: int) -> tuple[float, float]:
    """Return the 95 % interval of a shared parameter in its unit, by its index among the unknowns."""
    shared = result.problem.shared[index]
    spread = Z95 * float(np.sqrt(max(cov[index, index], 0.0)))
    x = min(max(float(result.x[index]), shared.low), shared.high)  # a fit may end beyond a bound by its last digit
    return (shared.scale * max(x - spread, shared.low), shared.scale * min(x + spread, shared.high))


def interval_that_follows(
    result: FitResult, cov: FloatArray, value_of: Callable[[FitResult], float]
) -> tuple[float, float]:
    """Return the 95 % interval of what follows from the unknowns, to first order; never of the other sign."""
    value, slope = value_of(result), np.zeros(result.x.size)
    for i in np.flatnonzero(np.diag(cov) > 0.0):
        moved = result.x.copy()
        moved[i] -= STEP
        slope[i] = (value - value_of(replace(result, x=moved))) / STEP
    spread = Z95 * float(np.sqrt(max(float(slope @ cov @ slope), 0.0)))
    low, high = value - spread, value + spread
    return (max(low, 0.0), high) if value > 0.0 else (low, min(high, 0.0))


def trusted(result: FitResult, index: int) -> tuple[float, float]:
    """Return what a nominal parameter is trusted to, in its unit: a fit that leaves physics out can't narrow it."""
    shared = result.problem.shared[index]
    return (shared.scale * shared.low, shared.scale * shared.high)


def interval_both_ways(result: FitResult, cov: FloatArray, index: int) -> tuple[float, float]:
    """Return the 95 % interval of a shared parameter that also holds it in the other parametrisation of the motion.

    There it is multiplied by a factor, itself estimated: ``d(x f) = f dx + x df``.
    """
    low, high = interval(result, cov, index)
    dimension = _dimension_in_line(result.problem.shared[index])
    factor, slope = _rescaled(result, result.x, dimension), np.zeros_like(result.x)
    if factor == 1.0:
        return low, high
    for i, shared in enumerate(result.problem.shared):
        if shared.effect and shared.low < shared.high:
            moved = result.x.copy()
            moved[i] += STEP
            slope[i] = result.x[index] * (_rescaled(result, moved, dimension) - factor) / STEP
    slope[index] += factor
    scale = result.problem.shared[index].scale
    other, spread = scale * factor * float(result.x[index]), scale * Z95 * float(np.sqrt(slope @ cov @ slope))
    return (min(low, other - spread), max(high, other + spread))


def _dimension_in_line(shared: Shared) -> str:
    if not shared.effect:
        return parameter_dimension(shared.name)
    entry = EFFECTS[shared.effect]
    (dimension,) = (parameter.dimension for parameter in entry.parameters if parameter.name == shared.name)
    return "" if entry.element is Element.TORQUE_PATH else dimension


def _rescaled(result: FitResult, x: FloatArray, dimension: str) -> float:
    """Return the factor on a dimension in the other way to tell the same motion; 1 where there is none."""
    factor = 1.0
    for name, entry in EFFECTS.items():
        values = {s.name: float(x[i]) * s.scale for i, s in enumerate(result.problem.shared) if s.effect == name}
        if values:
            factor *= entry.rescaled(values).get(dimension, 1.0)
    return factor


def moments_in(name: str, result: FitResult) -> dict[str, tuple[Interval, ...]]:
    """Return when an event lasts in each recording that has it, on the recording's own time [s].

    One that would be another effect if it always acted is no event in a recording through which it does.
    """
    found: dict[str, tuple[Interval, ...]] = {}
    for record, (from_s, to_s) in zip(result.problem.records, moments_of(result, name), strict=True):
        began = float(record.time_s[0] - record.since_start_s[0])
        is_seen = not EFFECTS[name].permanent or inside(record, from_s) or inside(record, to_s)
        if record.lead is None and is_seen and to_s - from_s > record.sample_time_s:
            found[record.name] = ((began + from_s, began + to_s),)
    return found


def found_effect(standing: Standing, runs: FreeRuns, estimate: Estimate) -> FoundEffect:
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
        parameters = parameters_of(standing.name, estimate.fit, estimate.covariance, model)
    p_value = max(math.exp(-0.5 * max(standing.evidence, 0.0)), Noise.SMALLEST_P)
    return FoundEffect(
        name=entry.name,
        element=entry.element,
        statement=entry.sentence(nulls | {name: p.value for name, p in parameters.items()}, model.motion),
        parameters=parameters,
        time_s=moments_in(standing.name, estimate.fit) if entry.event else {},
        indistinguishable_from=tuple(standing.alike),
        alternatives=standing.alike,
        evidence=Evidence(standing.evidence, runs.held_before, runs.held_after, p_value),
        profiles=profiles,
        share=standing.share,
        probability=standing.necessity.counted.probability,
        form=entry.form({name: p.value for name, p in parameters.items()}),
        necessity=standing.necessity.value,
        least_necessity=standing.necessity.least,
        counted=standing.necessity.counted,
    )


def parameters_of(name: str, result: FitResult, cov: FloatArray, model: DrivelineModel) -> dict[str, Estimated]:
    """Return what was fitted, and what was held; a held value at its null only where a model file needs it."""
    entry = EFFECTS[name]
    units = {parameter.name: parameter.unit(model.motion) for parameter in entry.parameters}
    left_out = {parameter.name: parameter.null for parameter in EFFECTS[name].parameters if parameter.optional}
    follow = _derived(name, result)
    return (
        {
            shared.name: Estimated(
                float(result.x[i]) * shared.scale,
                interval_both_ways(result, cov, i),
                units[shared.name],
            )
            for i, shared in enumerate(result.problem.shared)
            if shared.effect == name and shared.low < shared.high
        }
        | {
            shared.name: Estimated(value, (value, value), units[shared.name])
            for i, shared in enumerate(result.problem.shared)
            if shared.effect == name and shared.low == shared.high
            for value in [float(result.x[i]) * shared.scale]
            if value != left_out.get(shared.name) and shared.name not in follow
        }
        | {
            key: Estimated(value, interval_that_follows(result, cov, partial(_derived_value, name, key)), units[key])
            for key, value in follow.items()
        }
    )


def _derived(name: str, result: FitResult) -> Mapping[str, float]:
    """Return the values of an effect that are held but follow from what was fitted."""
    return EFFECTS[name].derived(result.values_of(name), line_values(result))


def _derived_value(name: str, key: str, result: FitResult) -> float:
    return _derived(name, result)[key]


def profiles_of(result: FitResult, cov: FloatArray, model: DrivelineModel) -> dict[str, Profile]:
    """Return the course of a load profile over each recording's own time, with its 95 % band."""
    torque_unit = unit("torque", model.motion)
    profiles = {}
    first = len(result.problem.shared)
    for i, (record, basis) in enumerate(zip(result.problem.records, result.problem.bases, strict=False)):
        local = local_part(result.problem, result.x, i)
        rows = slice(first + local.size - basis.profile.shape[0], first + local.size)
        first += local.size
        times = np.arange(record.time_s[0], record.time_s[-1], PROFILE_POINTS_S)
        weights = (grade_basis(record.time_s, times) * basis.scale[-basis.profile.shape[0] :, None]).T
        weights = weights - weights.mean(axis=0)  # the mean is the constant load's
        value = weights @ result.x[rows]
        spread = Z95 * np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", weights, cov[rows, rows], weights), 0.0))
        profiles[record.name] = Profile(times, value, value - spread, value + spread, torque_unit)
    return profiles


def profile_size(result: FitResult, cov: FloatArray, model: DrivelineModel) -> dict[str, Estimated]:
    """Return the size of a load profile: its RMS over all recordings, with its interval."""
    profiles = profiles_of(result, cov, model).values()
    value = np.concatenate([profile.value for profile in profiles])
    half = np.concatenate([0.5 * (profile.high - profile.low) for profile in profiles])
    size = float(np.sqrt(np.mean(value**2)))
    spread = float(np.sqrt(np.mean(half**2) / max(len(value), 1)))
    name = ROAD_GRADE.parameters[0].name
    return {name: Estimated(size, (max(size - spread, 0.0), size + spread), unit("torque", model.motion))}


def moved_values(of: Hypothesis, other: FitResult) -> dict[str, float]:
    """Return by what share of itself each shared value of a hypothesis is another in another fit.

    Of those that are outside of their 95 % intervals there.
    """
    spread, result = np.sqrt(np.diag(covariance_of_innovations(of))), of.result
    there = {(each.effect, each.name): i for i, each in enumerate(other.problem.shared)}
    moved = {}
    for i, each in enumerate(result.problem.shared):
        j = there.get((each.effect, each.name))
        if j is not None and spread[i] > 0.0 and result.x[i] != 0.0:
            value = other.x[j] * other.problem.shared[j].scale / each.scale
            if abs(value - result.x[i]) > Z95 * spread[i]:
                moved[f"{each.effect}.{each.name}" if each.effect else each.name] = float(value / result.x[i] - 1.0)
    return moved


def can_be_retuned(line: DrivelineModel) -> bool:
    """Tell whether a parameter is fitted: of a plant simulated elsewhere those that it can be given."""
    return line.plant is None or any(parameter.tolerance > 0.0 for parameter in line.parameters.values())


def retuned_parameters(result: FitResult, cov: FloatArray, model: DrivelineModel, whole: bool) -> dict[str, Retuned]:
    """Return every nominal parameter before and after; one trusted exactly stays what it was.

    Of a plant simulated elsewhere there are those that it can be given.
    """
    fitted = {
        shared.name: (
            float(result.x[i]) * shared.scale,
            interval_both_ways(result, cov, i) if whole else trusted(result, i),
        )
        for i, shared in enumerate(result.problem.shared)
        if not shared.effect and shared.name in model.parameters
    }
    parameters = {}
    for name, parameter in model.parameters.items():
        if model.plant is not None and name not in fitted:
            continue
        value, ci95 = fitted.get(name, (parameter.value, (parameter.value, parameter.value)))
        parameters[name] = Retuned(parameter.value, value, ci95, parameter_unit(name, model.motion))
    return parameters


def load_torques(result: FitResult, cov: FloatArray, model: DrivelineModel) -> dict[str, Estimated]:
    """Return the constant load torque of each recording (translation: the offset force), by name.

    One that all recordings share, or that the model gives, is every recording's.
    """
    torques = {}
    first = len(result.problem.shared)
    shared = {unknown.name: (k, unknown.scale) for k, unknown in enumerate(result.problem.shared) if not unknown.effect}
    for i, (record, basis) in enumerate(zip(result.problem.records, result.problem.bases, strict=False)):
        own = local_part(result.problem, result.x, i)[LOAD_TORQUE] * basis.scale[LOAD_TORQUE]
        value = float(own + result.p[slot("", LOAD)])
        index, scale = shared.get(LOAD, (first + LOAD_TORQUE, float(basis.scale[LOAD_TORQUE])))
        spread = Z95 * math.sqrt(max(float(cov[index, index]), 0.0)) * scale
        torques[record.name] = Estimated(value, (value - spread, value + spread), unit("torque", model.motion))
        first += basis.guess.size
    return torques


def augmented_model(
    result: FitResult, cov: FloatArray, model: DrivelineModel, effects: Sequence[FoundEffect]
) -> DrivelineModel:
    """Return the model with re-tuned parameters and the effects found in addition to those it had."""
    parameters = {**model.parameters, **_retuned_line(result, cov, model)}
    added: dict[str, Mapping[str, EffectValue]] = {
        effect.name: {name: EffectValue(p.value, p.ci95).at(p.value) for name, p in effect.parameters.items()}
        for effect in effects  # the interval holds it: a fit may end beyond a bound by its last digit
    }
    return replace(model, parameters=parameters, effects={**_retuned_effects(result, model), **added})


def _retuned_line(result: FitResult, cov: FloatArray, model: DrivelineModel) -> dict[str, Parameter]:
    """Return the nominal parameters that were fitted; one that was unknown, with the interval that it has now."""
    found = dict[str, Parameter]()
    for i, shared in enumerate(result.problem.shared):
        if shared.effect or shared.name not in model.parameters:
            continue
        value, known = float(result.x[i]) * shared.scale, model.parameters[shared.name]
        if known.is_unknown:
            known = replace(known, ci95=interval(result, cov, i))
        found[shared.name] = known.at(value)
    return found


def _retuned_effects(result: FitResult, model: DrivelineModel) -> dict[str, Mapping[str, EffectValue]]:
    """Return the effects that a model had, those known roughly with the values that were fitted."""
    return {
        name: {key: v.at(result.values_of(name).get(key, v.value)) for key, v in values.items()}
        for name, values in model.effects.items()
    }


def slight(trace: Standing, believed: Hypothesis, without: FitResult) -> Slight:
    """Return a trace of a believed set; in the fit without it some values are others, though the error hardly is."""
    values = believed.result.values_of(trace.name)
    return Slight(trace.name, trace.share, values, moved_values(believed, without), trace.slight)
