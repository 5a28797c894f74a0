"""What re-tuning could explain is taken out, no more; a promise is what a least-squares fit with bounds gives."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from estimator.physics.own_scan import Projector
from tests.estimator.diagnosis.regression import regression

SAMPLES = 400


@pytest.fixture
def design() -> np.ndarray:
    return np.random.default_rng(1).standard_normal((SAMPLES, 3))


@pytest.fixture
def noise() -> np.ndarray:
    return np.random.default_rng(2).standard_normal(SAMPLES)


class TestRest:
    def test_what_re_tuning_explains_is_gone(self, design: np.ndarray, noise: np.ndarray) -> None:
        """Of every signal, in every combination of the free unknowns' answers."""
        project = Projector(regression([design], [noise]))
        np.testing.assert_allclose(project.rest(design @ [3.0, -2.0, 0.5]), 0.0, atol=1e-12)
        np.testing.assert_allclose(project.rest(design.T), 0.0, atol=1e-12)

    def test_what_is_left_is_what_a_regression_leaves(self, design: np.ndarray, noise: np.ndarray) -> None:
        signals = np.random.default_rng(3).standard_normal((2, SAMPLES))
        left = Projector(regression([design], [noise])).rest(signals)
        for signal, rest in zip(signals, left, strict=True):
            expected = signal - design @ np.linalg.lstsq(design, signal, rcond=None)[0]
            np.testing.assert_allclose(rest, expected, atol=1e-12)

    def test_of_a_converged_fit_all_of_the_error_is_left(self, design: np.ndarray, noise: np.ndarray) -> None:
        result = regression([design], [noise])
        np.testing.assert_allclose(Projector(result).error, result.residual, atol=1e-12)

    def test_an_unknown_at_its_bound_explains_nothing(self, design: np.ndarray, noise: np.ndarray) -> None:
        """Two unknowns want 0.5 and -0.5 and get them; the third wants 4 and may be 1."""
        project = Projector(regression([design], [design @ [0.5, -0.5, 4.0] + 0.1 * noise], bound=1.0))
        assert np.linalg.norm(project.rest(design[:, 2])) > 0.9 * np.linalg.norm(design[:, 2])
        np.testing.assert_allclose(project.rest(design[:, 0]), 0.0, atol=1e-12)


class TestPromise:
    """Along a regressor that the fit did not have."""

    @staticmethod
    def fall(design: np.ndarray, along: np.ndarray, y: np.ndarray, low: float, high: float) -> float:
        """Fall of the squared error by scipy's bounded least squares on the regression itself."""
        without = lsq_linear(design, y, tol=1e-12).cost
        bounds = [-np.inf] * design.shape[1] + [low], [np.inf] * design.shape[1] + [high]
        return float(2.0 * (without - lsq_linear(np.column_stack([design, along]), y, bounds, tol=1e-12).cost))

    @pytest.mark.parametrize(("low", "high"), [(-10.0, 10.0), (0.0, 1.0), (-10.0, 0.0)])
    def test_it_is_what_least_squares_within_bounds_gains(
        self, design: np.ndarray, noise: np.ndarray, low: float, high: float
    ) -> None:
        along = np.random.default_rng(4).standard_normal(SAMPLES) + design[:, 0]
        y = design @ [0.3, -0.2, 0.1] + 1.7 * along + noise
        size, fall = Projector(regression([design], [y])).promise(along, low, high)
        assert size == pytest.approx(np.clip(self.free_size(design, along, y), low, high), abs=1e-9)
        assert fall == pytest.approx(self.fall(design, along, y, low, high), abs=1e-6)

    @staticmethod
    def free_size(design: np.ndarray, along: np.ndarray, y: np.ndarray) -> float:
        return float(np.linalg.lstsq(np.column_stack([design, along]), y, rcond=None)[0][-1])

    def test_an_unknown_pressed_against_its_bound_comes_back(self, noise: np.ndarray) -> None:
        """Without the direction the only unknown wants 2.2 and may be 1; with it 0.2 is right, and all fits."""
        x = np.random.default_rng(5).standard_normal(SAMPLES)
        along = 0.8 * x + 0.6 * np.random.default_rng(6).standard_normal(SAMPLES)
        y = 0.2 * x + 2.5 * along
        result = regression([x[:, None]], [y], bound=1.0)
        assert result.x[0] == 1.0
        size, fall = Projector(result).promise(along, -10.0, 10.0)
        assert size == pytest.approx(2.5)
        assert fall == pytest.approx(result.squares)

    def test_a_direction_that_re_tuning_has_promises_nothing(self, design: np.ndarray, noise: np.ndarray) -> None:
        project = Projector(regression([design], [noise]))
        assert project.promise(design @ [1.0, 2.0, 3.0], -10.0, 10.0)[1] == pytest.approx(0.0, abs=1e-6)
        assert project.promise(np.zeros(SAMPLES), -10.0, 10.0) == (0.0, 0.0)

    def test_no_effect_promises_to_make_it_worse(self, design: np.ndarray, noise: np.ndarray) -> None:
        along = np.random.default_rng(7).standard_normal(SAMPLES)
        project = Projector(regression([design], [design @ [0.3, -0.2, 0.1] - 2.0 * along + noise]))
        size, fall = project.promise(along, 0.0, 5.0)
        assert size == pytest.approx(0.0, abs=1e-9)
        assert fall == pytest.approx(0.0, abs=1e-6)

    def test_an_unknown_that_does_nothing_changes_no_promise(self, design: np.ndarray, noise: np.ndarray) -> None:
        """As a phase does while its amplitude is 0."""
        along = np.random.default_rng(7).standard_normal(SAMPLES)
        y = design @ [0.3, -0.2, 0.1] + 1.5 * along + noise
        idle = np.column_stack([design, np.zeros(SAMPLES)])
        with_idle = Projector(regression([idle], [y])).promise(along, -5.0, 5.0)
        assert with_idle == pytest.approx(Projector(regression([design], [y])).promise(along, -5.0, 5.0))
