import numpy as np
import pytest

from estimator.identification.linear_model import ROWS, singular_values, solve_least_squares, triangular


@pytest.mark.parametrize("shape", [(200, 7), (7, 7), (3, 7), (50, 1), (1, 1)])
@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
def test_the_triangle_is_that_of_the_textbook(shape: tuple[int, int], scale: float) -> None:
    A = np.random.default_rng(0).normal(size=shape)
    R = triangular(scale * A) / scale
    expected = np.linalg.qr(A)[1]
    np.testing.assert_allclose(np.abs(R), np.abs(expected), atol=1e-12)
    assert np.array_equal(R, np.triu(R))


def test_singular_values_and_solution_agree_with_the_library() -> None:
    rng = np.random.default_rng(1)
    A, b = rng.normal(size=(300, 9)) * np.logspace(0, -5, 9), rng.normal(size=300)
    np.testing.assert_allclose(singular_values(A), np.linalg.svd(A, compute_uv=False), rtol=1e-10)
    np.testing.assert_allclose(solve_least_squares(A, b), np.linalg.lstsq(A, b, rcond=None)[0], rtol=1e-9)


def test_where_columns_depend_the_solution_has_least_norm() -> None:
    rng = np.random.default_rng(2)
    column, b = rng.normal(size=100), rng.normal(size=100)
    x = solve_least_squares(np.column_stack([column, column, np.zeros(100)]), b)
    assert x[0] == pytest.approx(x[1])
    assert x[2] == 0.0


def test_the_matrix_is_not_changed() -> None:
    A = np.random.default_rng(3).normal(size=(20, 4))
    before = A.copy()
    triangular(A)
    assert np.array_equal(A, before)


def test_a_matrix_longer_than_what_is_reduced_at_a_time_and_its_rows_that_count() -> None:
    A, b = (np.random.default_rng(4).normal(size=shape) for shape in ((2 * ROWS + 9, 3), 2 * ROWS + 9))
    rows = np.arange(b.size) % 7 != 0
    R = triangular(A, b, rows=rows)
    both = np.column_stack([A, b])[rows]
    np.testing.assert_allclose(R.T @ R, both.T @ both, rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(solve_least_squares(A, b), np.linalg.lstsq(A, b, rcond=None)[0], rtol=1e-9)
