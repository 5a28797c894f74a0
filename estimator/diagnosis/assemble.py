"""From a selection to the parts of a diagnosis: effects with their intervals, parameters, the augmented model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from estimator.diagnosis.chain import Chain
from estimator.diagnosis.hypotheses import line_values
from estimator.diagnosis.intervals import (
    Z95,
    interval_both_ways,
    interval_that_follows,
    reported_covariance,
    trusted,
)
from estimator.diagnosis.noise import gain_from_squares
from estimator.diagnosis.result import Estimated, Evidence, FoundEffect, Interval, Profile, Retuned
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effects.load import ROAD_GRADE, grade_basis
from estimator.physics.fit import FitResult
from estimator.physics.layout import LOAD, slot
from estimator.physics.model import DrivelineModel, EffectValue, parameter_unit, unit
from estimator.physics.problem import local_part
from estimator.physics.steps import inside, moments_of
from estimator.physics.unknowns import LOAD_TORQUE
from estimator.signals.record import FloatArray

PROFILE_POINTS_S = 1.0
"""A profile is reported every second."""


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


def acquired_effects(
    chain: Chain, before: Sequence[FloatArray], after: Sequence[FloatArray]
) -> tuple[FoundEffect, ...]:
    """Return what was recognised of the acquisition as effects."""
    gained = gain_from_squares(_squares(before), _squares(after), 1, 1, after)
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
            evidence=Evidence(gained.delta_bic, held[0], held[1], finding.p_value),
        )
        for finding in chain.findings
    )


def _squares(errors: Sequence[FloatArray]) -> float:
    return float(sum(error @ error for error in errors))


def rms_of(errors: Sequence[FloatArray]) -> float:
    """Return the RMS of the errors of several recordings together."""
    return float(np.sqrt(_squares(errors) / sum(error.size for error in errors)))


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


def retuned_parameters(result: FitResult, model: DrivelineModel, whole: bool) -> dict[str, Retuned]:
    """Return every nominal parameter before and after; one trusted exactly stays what it was.

    Of a plant simulated elsewhere there are none.
    """
    if model.plant is not None:
        return {}
    cov = reported_covariance(result)
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
        value, ci95 = fitted.get(name, (parameter.value, (parameter.value, parameter.value)))
        parameters[name] = Retuned(parameter.value, value, ci95, parameter_unit(name, model.motion))
    return parameters


def load_torques(result: FitResult, model: DrivelineModel) -> dict[str, Estimated]:
    """Return the constant load torque of each recording (translation: the offset force), by name.

    One that all recordings share, or that the model gives, is every recording's.
    """
    cov = reported_covariance(result)
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


def augmented_model(result: FitResult, model: DrivelineModel, effects: Sequence[FoundEffect]) -> DrivelineModel:
    """Return the model with re-tuned parameters and the effects found in addition to those it had."""
    values = {
        shared.name: float(result.x[i]) * shared.scale
        for i, shared in enumerate(result.problem.shared)
        if not shared.effect
    }
    parameters = {
        name: replace(parameter, value=values.get(name, parameter.value))
        for name, parameter in model.parameters.items()
    }
    added: dict[str, Mapping[str, EffectValue]] = {
        effect.name: {name: EffectValue(p.value, p.ci95) for name, p in effect.parameters.items()} for effect in effects
    }
    return replace(model, parameters=parameters, effects={**_retuned_effects(result, model), **added})


def _retuned_effects(result: FitResult, model: DrivelineModel) -> dict[str, Mapping[str, EffectValue]]:
    """Return the effects that a model had, those known roughly with the values that were fitted."""
    return {
        name: {key: replace(v, value=result.values_of(name).get(key, v.value)) for key, v in values.items()}
        for name, values in model.effects.items()
    }
