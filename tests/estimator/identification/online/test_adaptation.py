"""Each profile through the estimator's own loop, against equation (5) with the profile's lambdas."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from estimator.errors import BadSetting
from estimator.identification.linear_model import Orders
from estimator.identification.online.adaptation import (
    Adaptation,
    ConstantForgetting,
    DecreasingGain,
    DecreasingThenConstantTrace,
    GainLaw,
    VariableForgetting,
)
from estimator.identification.online.oefo import Oefo
from estimator.signals.record import FloatArray

MOVING_AVERAGE = Orders(na=0, nb=3, nk=1)  # no outputs in the regressor: phi is known beforehand


def regressors(u: FloatArray) -> FloatArray:
    padded = np.concatenate([np.zeros(3), u])
    return np.stack([padded[t + 2 : t - 1 if t else None : -1][:3] for t in range(u.shape[0])])


def after(profile: Adaptation, u: FloatArray) -> Oefo:
    estimator = Oefo(np.ones(1), MOVING_AVERAGE, profile)
    estimator.run(u, np.zeros_like(u), np.ones(u.shape, dtype=bool))
    return estimator


@pytest.fixture
def u() -> FloatArray:
    return np.random.default_rng(7).normal(size=300)


def test_decreasing_gain_sums_all_information(u: FloatArray) -> None:
    phi = regressors(u)
    np.testing.assert_allclose(np.linalg.inv(after(DecreasingGain(), u).F), np.eye(3) / 1000 + phi.T @ phi, rtol=1e-9)


@pytest.mark.parametrize(
    ("profile", "lambda0"), [(ConstantForgetting(0.97), 1.0), (VariableForgetting(0.9, 0.95), 0.95)]
)
def test_forgetting_follows_equation_5(profile: Adaptation, lambda0: float, u: FloatArray) -> None:
    information, lambda1 = np.eye(3) / 1000, profile.law.lambda1
    for row in regressors(u):
        if row.any():  # before the first input nothing is learnt, and nothing forgotten
            information = lambda1 * information
        information = information + np.outer(row, row)
        lambda1 = lambda0 * lambda1 + 1 - lambda0
    np.testing.assert_allclose(np.linalg.inv(after(profile, u).F), information, rtol=1e-6)


def test_the_trace_falls_and_is_then_held(u: FloatArray) -> None:
    profile = DecreasingThenConstantTrace(lambda1=0.993, trace=0.05)
    falling = [np.trace(after(profile, u[:n]).F) for n in range(5, 60, 5)]
    assert all(later <= earlier for earlier, later in pairwise(falling))
    assert falling[0] > 0.05
    for n in (150, 220, 300):
        assert np.trace(after(profile, u[:n]).F) == pytest.approx(0.05, rel=1e-12)


def test_while_the_trace_is_held_the_lambdas_keep_their_ratio(u: FloatArray) -> None:
    profile = DecreasingThenConstantTrace(lambda1=0.7, trace=0.05)
    F, following = after(profile, u[:200]).F, after(profile, u[:201]).F
    row = regressors(u)[200]
    direction = np.linalg.inv(F) + np.outer(row, row) / 0.7  # equation (5), divided by lambda_1
    expected = np.linalg.inv(direction)
    np.testing.assert_allclose(following, expected * 0.05 / np.trace(expected), rtol=1e-9)


def test_the_papers_tuning_is_the_default() -> None:
    assert DecreasingThenConstantTrace().law == GainLaw(1000.0, trace=0.01, alpha=0.993)


@pytest.mark.parametrize(
    "profile",
    [DecreasingGain(), ConstantForgetting(0.95), VariableForgetting(), DecreasingThenConstantTrace()],
)
def test_without_excitation_the_gain_stays_within_its_start(profile: Adaptation) -> None:
    estimator = after(profile, np.zeros(20_000))
    assert np.isfinite(estimator.F).all()
    assert np.trace(estimator.F) <= 3 * 1000 * (1 + 1e-12)


@pytest.mark.parametrize(
    "profile",
    [DecreasingGain(), ConstantForgetting(0.98), VariableForgetting(), DecreasingThenConstantTrace()],
)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_the_gain_stays_symmetric_and_positive_through_hours(profile: Adaptation, scale: float) -> None:
    t = np.arange(200_000)
    hard = scale * (np.sin(0.1 * t) + 1e-6 * np.random.default_rng(0).normal(size=t.shape))
    estimator = after(profile, hard)
    np.testing.assert_allclose(estimator.F, estimator.F.T, rtol=1e-12)
    assert np.isfinite(estimator.F).all()
    assert (estimator._D > 0).all()  # F = U D U^T is positive definite if D is


@pytest.mark.parametrize(
    ("law", "named"),
    [
        ({"initial_gain": 0.0}, "initial_gain"),
        ({"initial_gain": 1.0, "lambda1": 0.0}, "lambda1"),
        ({"initial_gain": 1.0, "lambda1": 1.01}, "lambda1"),
        ({"initial_gain": 1.0, "lambda0": 1.5}, "lambda0"),
        ({"initial_gain": 1.0, "trace": -0.1}, "trace"),
        ({"initial_gain": 1.0, "alpha": 0.5}, "alpha"),
    ],
)
def test_gains_out_of_range_are_refused(law: dict[str, float], named: str) -> None:
    with pytest.raises(BadSetting, match=f"adaptation gain: {named} is"):
        GainLaw(**law)
