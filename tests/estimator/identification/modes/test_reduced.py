"""The third-order equivalent of a model."""

import numpy as np
import pytest

from estimator.errors import BadModel
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import resonance
from estimator.identification.modes.reduced import state_space, third_order, to_continuous
from estimator.identification.offline.fits import fit_output_error
from estimator.signals.decimate import decimate
from tests.estimator.identification.driveline import Cruise

PERIOD_S = 0.01


@pytest.mark.parametrize("nk", [0, 1, 3])
def test_the_state_space_has_the_models_response(nk: int) -> None:
    model = LinearModel((-1.2, 0.5), (0.3, 0.1), nk, PERIOD_S)
    A, B, C, D = state_space(model)
    frequency_hz = np.array([0.0, 3.0, 20.0, 49.0])
    z = np.exp(2j * np.pi * frequency_hz * PERIOD_S)
    response = [(C @ np.linalg.solve(at * np.eye(A.shape[0]) - A, B))[0, 0] + D for at in z]
    np.testing.assert_allclose(response, model.response(frequency_hz))


@pytest.mark.parametrize("a", [(0.5,), (-0.4, -0.1), (0.0,), ()])
def test_poles_no_continuous_system_has_are_refused(a: tuple[float, ...]) -> None:
    with pytest.raises(BadModel, match="no continuous system has such samples"):
        to_continuous(LinearModel(a, (1.0,), 1, PERIOD_S))


T_S = 0.02
FREQUENCY_HZ = np.linspace(0.01, 24.9, 400)


def fourth_order(small: float) -> LinearModel:
    """A third-order model and a fourth state of a given share, in parallel."""
    pair = np.exp(T_S * 2 * np.pi * 8.2 * (-0.057 + 1j))
    a3, b3 = np.real(np.poly([pair, pair.conj(), 0.98])), np.array([0.01, -0.015, 0.008])
    a = np.polymul(a3, [1.0, 0.6])
    b = np.polyadd(np.polymul(b3, [1.0, 0.6]), small * a3)
    return LinearModel(tuple(a[1:].tolist()), tuple(b.tolist()), 1, T_S)


@pytest.mark.parametrize("small", [1e-4, 1e-3])
def test_the_response_changes_by_no_more_than_the_bound(small: float) -> None:
    model = fourth_order(small)
    reduced = third_order(model)
    error = np.abs(reduced.model.response(FREQUENCY_HZ) - model.response(FREQUENCY_HZ))
    assert error.max() <= reduced.largest_error * 1.0001
    assert reduced.largest_error < 10 * small
    assert len(reduced.model.a) == 3
    assert reduced.model.is_stable


@pytest.mark.parametrize("nk", [0, 1, 2])
def test_what_is_of_third_order_or_less_stays_what_it_is(nk: int) -> None:
    model = LinearModel((-1.6, 0.8), (0.1, 0.05), nk, T_S)
    reduced = third_order(model)
    np.testing.assert_allclose(reduced.model.response(FREQUENCY_HZ), model.response(FREQUENCY_HZ), rtol=1e-8)
    assert reduced.largest_error == pytest.approx(0.0, abs=1e-9)


def test_the_covariance_goes_along() -> None:
    model = fourth_order(1e-3)
    S = 1e-5 * np.random.default_rng(0).normal(size=(8, 8))
    reduced = third_order(model, S @ S.T)
    thetas = np.random.default_rng(1).multivariate_normal(model.theta, S @ S.T, size=600)
    scattered = [third_order(LinearModel.from_theta(theta, model.orders, T_S)).model.theta for theta in thetas]
    assert reduced.covariance is not None
    np.testing.assert_allclose(np.sqrt(np.diag(reduced.covariance)), np.std(scattered, axis=0), rtol=0.12)


def test_the_papers_fourth_order_models_keep_their_resonance(cruises: list[Cruise]) -> None:
    for drive in cruises:
        mode = resonance(third_order(fit_output_error(decimate(drive.record, 2)).model).model)
        assert mode is not None
        assert mode.frequency_hz == pytest.approx(drive.resonance_hz, rel=0.01)
        assert mode.damping == pytest.approx(drive.damping, rel=0.15)
