"""Each profile through the estimator's own loop, against equation (5) with the profile's lambdas."""

from itertools import pairwise

import numpy as np
import pytest

from estimator.errors import BadSetting
from estimator.identification.linear_model import Orders
from estimator.identification.online.adaptation import (
    PROFILES,
    Adaptation,
    ConstantForgetting,
    ConstantGain,
    ConstantTrace,
    DecreasingGain,
    DecreasingThenConstantTrace,
    GainLaw,
    VariableForgetting,
)
from estimator.identification.online.estimators import Oefo
from estimator.identification.online.recursive import Reason, Status
from estimator.signals.record import FloatArray
from tests.estimator.identification.online.cases import LINEAR, linear_data

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


@pytest.mark.parametrize(
    "profile", [DecreasingGain(), ConstantForgetting(0.95), VariableForgetting(), DecreasingThenConstantTrace()]
)
def test_without_excitation_the_gain_stays_within_its_start(profile: Adaptation) -> None:
    estimator = after(profile, np.zeros(20_000))
    assert np.isfinite(estimator.F).all()
    assert np.trace(estimator.F) <= 3 * 1000 * (1 + 1e-12)


@pytest.mark.parametrize(
    "profile", [DecreasingGain(), ConstantForgetting(0.98), VariableForgetting(), DecreasingThenConstantTrace()]
)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_the_gain_stays_symmetric_and_positive_through_hours(profile: Adaptation, scale: float) -> None:
    t = np.arange(200_000)
    hard = scale * (np.sin(0.1 * t) + 1e-6 * np.random.default_rng(0).normal(size=t.shape))
    estimator = after(profile, hard)
    np.testing.assert_allclose(estimator.F, estimator.F.T, rtol=1e-12)
    assert np.isfinite(estimator.F).all()
    assert (estimator._memory["D"] > 0).all()  # F = U D U^T is positive definite if D is


@pytest.mark.parametrize(
    ("law", "named"),
    [
        ({"initial_gain": 0.0}, "initial_gain"),
        ({"initial_gain": 1.0, "lambda1": 0.0}, "lambda1"),
        ({"initial_gain": 1.0, "lambda1": 1.01}, "lambda1"),
        ({"initial_gain": 1.0, "lambda0": 1.5}, "lambda0"),
        ({"initial_gain": 1.0, "trace": -0.1}, "trace"),
        ({"initial_gain": 1.0, "alpha": 0.5}, "alpha"),
        ({"initial_gain": 1.0, "lambda2": 0.5}, "lambda2"),
    ],
)
def test_gains_out_of_range_are_refused(law: dict[str, float], named: str) -> None:
    with pytest.raises(BadSetting, match=f"adaptation gain: {named} is"):
        GainLaw(**law)


FAST = {ConstantTrace: ConstantTrace(0.2), ConstantGain: ConstantGain(0.2)}


@pytest.mark.parametrize("profile", PROFILES, ids=lambda profile: profile.__name__)
def test_with_every_profile_the_truth_is_found_and_the_status_reported(profile: type[Adaptation]) -> None:
    u, y, okay = linear_data(8000)
    estimator = Oefo(np.ones(1), LINEAR.orders, FAST.get(profile, profile()))
    block = estimator.run(u, y, okay)
    assert block[20].reason is Reason.TOO_FEW_SAMPLES
    assert block[7999].status is Status.ESTIMATED
    np.testing.assert_allclose(block.theta[-1], LINEAR.theta, atol=0.01)
    quiet = Oefo(np.ones(1), LINEAR.orders, FAST.get(profile, profile()))
    nothing = np.zeros(500)
    assert quiet.run(nothing, nothing, np.ones(500, dtype=bool))[499].reason is Reason.NOT_EXCITED


# A gain that does not fall lets theta wander with the noise; filtered by 1 / L the observations are ten times larger.
SLOW = {ConstantTrace: ConstantTrace(1e-5), ConstantGain: ConstantGain(1e-5)}


@pytest.mark.parametrize(
    "profile",
    [
        pytest.param(each, marks=() if each is DecreasingThenConstantTrace else pytest.mark.campaign)
        for each in PROFILES
    ],
    ids=lambda profile: profile.__name__,
)
@pytest.mark.parametrize("excited", [True, False, None], ids=["excited", "not excited", "now and then"])
def test_three_hours_at_10_ms_leave_the_gain_sound(profile: type[Adaptation], excited: bool | None) -> None:
    n = 1_100_000
    u, y = (np.tile(each, 20)[:n] for each in linear_data(55_000, noise=0.1)[:2])
    if excited is not True:
        silent = np.full(n, True) if excited is False else np.arange(n) // 100_000 % 2 == 1
        u, y = np.where(silent, 0.0, u), np.where(silent, 1e-3 * y, y)
    estimator = Oefo(LINEAR.A, LINEAR.orders, SLOW.get(profile, profile()), start_up_samples=40)
    block = estimator.run(u, y, np.ones(n, dtype=bool))
    assert np.isfinite(block.theta).all()
    assert np.isfinite(estimator.F).all()
    np.testing.assert_allclose(estimator.F, estimator.F.T, rtol=1e-9, atol=1e-300)
    assert (estimator._memory["D"] > 0).all()
    if excited is True:
        np.testing.assert_allclose(estimator.theta, LINEAR.theta, atol=0.05)
