import numpy as np
import pytest

from estimator.errors import BadSetting, NotExciting
from estimator.identification.linear_model import (
    ROWS,
    LinearModel,
    Orders,
    products_of_past,
    singular_values,
    solve_least_squares,
    triangular,
)
from estimator.identification.settings import excitation_order, require_excitation
from estimator.signals.prbs import prbs_nm
from estimator.signals.record import FloatArray

MODEL = LinearModel(a=(-1.5, 0.7), b=(0.4, -0.1, 0.3), nk=2, sample_time_s=0.02)


def test_the_difference_equation_is_the_stated_convention() -> None:
    rng = np.random.default_rng(0)
    u = rng.normal(size=60)
    y = np.zeros(60)
    for t in range(60):
        past_y = [y[t - i] if t >= i else 0.0 for i in (1, 2)]
        past_u = [u[t - 2 - j] if t >= 2 + j else 0.0 for j in range(3)]
        y[t] = 1.5 * past_y[0] - 0.7 * past_y[1] + 0.4 * past_u[0] - 0.1 * past_u[1] + 0.3 * past_u[2]
    np.testing.assert_allclose(MODEL.simulate(u), y, atol=1e-12)


def test_the_frequency_response_is_that_of_a_settled_sine() -> None:
    frequency_hz, n = 3.0, 4000
    t = 0.02 * np.arange(n)
    y = MODEL.simulate(np.sin(2 * np.pi * frequency_hz * t))[2000:]
    turned = np.exp(-2j * np.pi * frequency_hz * t[2000:])
    measured = 2j * np.mean(y * turned)  # 120 whole periods
    assert MODEL.response(np.array([frequency_hz]))[0] == pytest.approx(measured, rel=1e-9)


def test_the_state_continues_an_interrupted_simulation() -> None:
    rng = np.random.default_rng(1)
    u = rng.normal(size=80)
    whole = MODEL.simulate(u)
    # C of what came before, from the last outputs and inputs: C = B u_past - A y_past for t >= 0.
    before_y, before_u = whole[:50], u[:50]
    state = np.zeros(MODEL.orders.n_states)
    for t in range(state.shape[0]):
        state[t] = -sum(MODEL.A[i] * before_y[t - i] for i in range(t + 1, 3))
        state[t] += sum(MODEL.B[j] * before_u[t - j] for j in range(t + 1, 5))
    np.testing.assert_allclose(MODEL.simulate(u[50:], state), whole[50:], atol=1e-12)


@pytest.mark.parametrize(
    ("orders", "named"), [((-1, 1, 1), "na is -1"), ((1, 0, 1), "nb is 0"), ((1, 1, -1), "nk is -1")]
)
def test_impossible_orders_are_refused(orders: tuple[int, int, int], named: str) -> None:
    with pytest.raises(BadSetting, match=named):
        Orders(*orders)


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


def test_a_matrix_longer_than_what_is_reduced_at_a_time_and_its_rows_that_count() -> None:
    A, b = (np.random.default_rng(4).normal(size=shape) for shape in ((2 * ROWS + 9, 3), 2 * ROWS + 9))
    rows = np.arange(b.size) % 7 != 0
    R = triangular(A, b, rows=rows)
    both = np.column_stack([A, b])[rows]
    np.testing.assert_allclose(R.T @ R, both.T @ both, rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(solve_least_squares(A, b), np.linalg.lstsq(A, b, rcond=None)[0], rtol=1e-9)


N = 600
T = np.arange(N)
ORDERS = Orders(4, 4, 1)


def refused(u: FloatArray, y: FloatArray | None = None, good: int = N) -> NotExciting:
    okay = T < good
    output = np.random.default_rng(0).normal(size=N) if y is None else y
    with pytest.raises(NotExciting) as refusal:
        require_excitation("run_7", u, output, okay, ORDERS)
    assert "run_7" in str(refusal.value)
    return refusal.value


@pytest.mark.parametrize(
    ("u", "order"),
    [
        (np.zeros(N), 0),
        (np.full(N, 3.0), 1),
        (np.sin(0.3 * T), 2),
        (2.0 + np.sin(0.3 * T), 3),
        (np.sin(0.3 * T) + 0.1 * np.sin(1.1 * T + 1), 4),
        (prbs_nm(N, 60.0, cells=3), 7),
        (prbs_nm(N, 60.0), 8),
    ],
)
def test_the_order_is_that_of_the_textbook(u: FloatArray, order: int) -> None:
    assert excitation_order(u, 8) == order


def test_a_prbs_that_moves_the_output_is_enough() -> None:
    require_excitation("run_7", prbs_nm(N, 60.0), np.sin(T), T < 80, ORDERS)


def test_a_sine_leaves_all_but_two_undetermined() -> None:
    assert refused(np.sin(0.3 * T)).names == ("a_2", "a_3", "a_4", "b_2", "b_3", "b_4")


def test_too_few_good_samples_are_refused() -> None:
    refusal = refused(prbs_nm(N, 60.0), good=79)
    assert "79 good samples, expected at least 80" in str(refusal)
    assert refusal.names == ORDERS.names


def test_an_output_that_never_moves_is_refused() -> None:
    refusal = refused(prbs_nm(N, 60.0), y=np.full(N, 120.0))
    assert "never changes" in str(refusal)
    assert refusal.names == ORDERS.names


@pytest.mark.parametrize("p", [1, 2, 50])
def test_products_of_the_past_are_those_of_the_rows_written_out(p: int) -> None:
    e = np.random.default_rng(p).standard_normal(300)
    rows = np.array([e[t - p : t][::-1] for t in range(p, e.size)])
    np.testing.assert_allclose(products_of_past(e, p), rows.T @ rows, atol=1e-10)
