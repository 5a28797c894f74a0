"""Phases and moments by a scan: what it answers is the effect itself, and what it chooses is the best there is."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from estimator.physics.catalogue import EFFECTS
from estimator.physics.layout import SIZE, slot
from estimator.physics.own_scan import MOST_CELLS, SHORTEST_CELL_S, Projector, Simulate, cells, scan, waves
from estimator.physics.unknowns import own_unknowns
from estimator.signals.record import FloatArray
from tests.estimator.diagnosis.regression import regression
from tests.estimator.physics.bench import record

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


BRAKE, IMBALANCE, RESOLVER = EFFECTS["brake_drag"], EFFECTS["load_imbalance"], EFFECTS["resolver_error"]


def each(run: Callable[[FloatArray], FloatArray]) -> Simulate:
    """One simulation after the other."""
    return lambda parameters, alike_s=None: np.array([run(p) for p in parameters])


class TestBestStretch:
    @staticmethod
    def by_trying(answers: FloatArray, error: FloatArray, size: float) -> tuple[float, int, int]:
        """Fall of the squared error of every interval; the largest with its rows."""
        falls = [
            (float(error @ error - np.sum((error + size * (answers[b] - answers[a])) ** 2)), a, b)
            for a in range(len(answers))
            for b in range(a + 1, len(answers))
        ]
        return max(falls)

    @pytest.mark.parametrize("seed", range(8))
    @pytest.mark.parametrize("size", [0.3, -1.0, 2.5])
    def test_it_is_what_trying_every_interval_finds(self, seed: int, size: float) -> None:
        rng = np.random.default_rng(seed)
        answers = np.vstack([np.zeros(200), np.cumsum(rng.standard_normal((12, 200)), axis=0)])
        first, last = sorted(rng.choice(13, 2, replace=False))
        error = rng.standard_normal(200) - size * (answers[last] - answers[first])
        found = scan(answers, error).best(size)
        taken, *rows = self.by_trying(answers, error, size)
        assert [found.first, found.last] == rows == [first, last]
        assert found.error_reduction == pytest.approx(taken)

    def test_a_size_whose_square_is_no_number_takes_nothing_away(self) -> None:
        answers = np.vstack([np.zeros(200), np.cumsum(np.random.default_rng(1).standard_normal((12, 200)), axis=0)])
        assert scan(answers, answers[3]).best(1e200).error_reduction == 0.0

    @pytest.mark.parametrize("seed", range(8))
    def test_what_is_lasting_begins_or_ends_with_the_recording(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        answers = np.vstack([np.zeros(200), np.cumsum(rng.standard_normal((12, 200)), axis=0)])
        error = rng.standard_normal(200) - 0.7 * (answers[12] - answers[4]) + 0.7 * (answers[9] - answers[7])
        taken, first, last = max(
            (float(error @ error - np.sum((error + 0.7 * (answers[b] - answers[a])) ** 2)), a, b)
            for a, b in [*((a, 12) for a in range(12)), *((0, b) for b in range(1, 13))]
        )
        found = scan(answers, error, lasting=True).best(0.7)
        assert (found.first, found.last) == (first, last)
        assert found.error_reduction == pytest.approx(taken)


class TestCells:
    TIME_S = np.arange(1200) * 0.01

    def run(self, p: FloatArray) -> FloatArray:
        """An effect that shows at once, while it lasts and in proportion, on top of something else."""
        begin, end = p[slot("brake_drag", "from_s")], p[slot("brake_drag", "to_s")]
        lasting = (self.TIME_S >= begin - 1e-9) & (self.TIME_S < end - 1e-9)
        return np.sin(self.TIME_S) + p[slot("brake_drag", "brake_nm")] * lasting

    def test_sums_of_answers_are_the_event_between_two_moments(self) -> None:
        own = own_unknowns(["brake_drag"], record(np.zeros(1200)))
        grid = cells(BRAKE, np.zeros(SIZE), own, {"brake_nm": 8.0}, each(self.run))
        assert (grid.moments_s[0], grid.moments_s[-1]) == (0.0, pytest.approx(12.0))
        for a, b in ((0, 24), (3, 4), (5, 19)):
            lasting = (self.TIME_S >= grid.moments_s[a] - 1e-9) & (self.TIME_S < grid.moments_s[b] - 1e-9)
            np.testing.assert_allclose(grid.answers[b] - grid.answers[a], lasting, atol=1e-9)

    @pytest.mark.parametrize(
        ("samples", "count"),
        [(150, 4), (1200, 24), (6000, MOST_CELLS)],
        ids=["at least four", "half a second each", "no more than so many"],
    )
    def test_cells_are_as_fine_as_they_may_be(self, samples: int, count: int) -> None:
        own = own_unknowns(["brake_drag"], record(np.zeros(samples)))
        grid = cells(BRAKE, np.zeros(SIZE), own, {"brake_nm": 8.0}, each(lambda _: np.zeros(samples)))
        assert SHORTEST_CELL_S == 0.5
        assert grid.moments_s.size == count + 1 == grid.answers.shape[0]
        np.testing.assert_array_equal(grid.answers[0], 0.0)


class TestWaves:
    ANGLE = np.linspace(0.0, 40.0, 500)

    def test_answers_are_a_cosine_and_a_quarter_turn_on(self) -> None:
        def run(p: FloatArray) -> FloatArray:
            amplitude, phase = (p[slot("load_imbalance", name)] for name in ("amplitude_nm", "phase_rad"))
            return 3.0 + amplitude * np.cos(self.ANGLE + phase)

        sizes, still = {"amplitude_nm": 6.0, "motor_turns_per_turn": 5.6}, run(np.zeros(SIZE))
        (wave,) = waves(IMBALANCE, np.zeros(SIZE), sizes, each(run), still)
        assert (wave.phase, wave.amplitude) == ("phase_rad", "amplitude_nm")
        np.testing.assert_allclose(wave.answers, [np.cos(self.ANGLE), -np.sin(self.ANGLE)], atol=1e-9)

    def test_every_amplitude_answers_with_the_others_silent(self) -> None:
        """Whatever sizes the parameter vector came with."""

        def run(p: FloatArray) -> FloatArray:
            once, twice = (p[slot("resolver_error", name)] for name in ("once_rad", "twice_rad"))
            phases = [p[slot("resolver_error", name)] for name in ("once_phase_rad", "twice_phase_rad")]
            ripple = once * np.cos(self.ANGLE + phases[0]) + twice * np.cos(2.0 * self.ANGLE + phases[1])
            return ripple + 50.0 * once * twice

        p = np.zeros(SIZE)
        p[slot("resolver_error", "once_rad")] = p[slot("resolver_error", "twice_rad")] = 0.4
        once, twice = waves(RESOLVER, p, {"once_rad": 0.1, "twice_rad": 0.1}, each(run), run(np.zeros(SIZE)))
        np.testing.assert_allclose(once.answers[0], np.cos(self.ANGLE), atol=1e-9)
        np.testing.assert_allclose(twice.answers[1], np.cos(2.0 * self.ANGLE + 0.5 * math.pi), atol=1e-9)
