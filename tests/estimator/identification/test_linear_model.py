import numpy as np
import pytest

from estimator.errors import BadSetting
from estimator.identification.linear_model import LinearModel, Orders

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
