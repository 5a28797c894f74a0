"""What every recursive estimator of the registry promises, tried on each of them."""

import json
import tracemalloc
from io import BytesIO

import numpy as np
import pytest

from estimator.errors import BadModel, BadSetting, BadShape
from estimator.identification.linear_model import LinearModel
from estimator.identification.online.adaptation import ConstantForgetting
from estimator.identification.online.estimators import ESTIMATORS, Setup
from estimator.identification.online.recursive import Estimate, Reason, RecursiveEstimator, Status
from estimator.signals.record import FloatArray
from tests.estimator.identification.online.cases import CASES, LINEAR, TWO_MASS, Case, two_mass_data


@pytest.fixture(params=list(CASES))
def case(request: pytest.FixtureRequest) -> Case:
    return CASES[request.param]


def one_by_one(estimator: RecursiveEstimator, u: FloatArray, y: FloatArray, okay: np.ndarray) -> list[Estimate]:
    return [estimator.update(float(a), float(b), bool(c)) for a, b, c in zip(u, y, okay, strict=True)]


def same_state(a: RecursiveEstimator, b: RecursiveEstimator) -> bool:
    mine, other = a.state(), b.state()
    return mine.keys() == other.keys() and all(np.array_equal(mine[key], other[key]) for key in mine)


def test_one_by_one_and_in_blocks_give_the_same_bits(case: Case) -> None:
    u, y, okay = case.data(600, 0.05, 0)
    okay[100:130] = False
    y[300], u[400], y[401] = np.nan, np.nan, np.inf
    whole, live, pieces = case.make(), case.make(), case.make()
    block = whole.run(u, y, okay)
    single = one_by_one(live, u, y, okay)
    cuts = [(0, 7), (7, 350), (350, 351), (351, 600)]
    joined = np.concatenate([pieces.run(u[a:b], y[a:b], okay[a:b]).theta for a, b in cuts])
    assert np.array_equal(block.theta, np.array([estimate.theta for estimate in single]))
    assert np.array_equal(block.theta, joined)
    for name in ("y_hat", "e_prior", "e_post", "used"):
        assert np.array_equal(getattr(block, name), [getattr(estimate, name) for estimate in single])
    assert [Reason(int(code)) for code in block.reason] == [estimate.reason for estimate in single]
    assert same_state(whole, live)
    assert same_state(whole, pieces)
    assert len(set(block.theta[:, 0])) > 100  # it did move


def test_strided_signals_give_the_same_bits_and_none_is_changed(case: Case) -> None:
    u, y, okay = case.data(200, 0.05, 0)
    spread = np.column_stack([u, y])
    before = spread.copy()
    straight = case.make().run(u, y, okay).theta
    assert np.array_equal(straight, case.make().run(spread[:, 0], spread[:, 1], okay).theta)
    assert np.array_equal(spread, before)


def test_it_finds_the_truth_without_noise(case: Case) -> None:
    u, y, okay = case.data(3000, 0.0, 0)
    estimator = case.make()
    last = estimator.run(u, y, okay)[2999]
    assert last.status is Status.ESTIMATED
    assert estimator.undetermined == ()
    assert estimator.statement(last.reason) == ""
    np.testing.assert_allclose(last.theta, case.truth, rtol=0.01, atol=0.005)
    assert estimator.model(0.02).theta.tolist() == last.theta.tolist()


def test_physical_parameters_come_out_of_the_kalman_filter() -> None:
    estimator = CASES["ekf"].make()
    block = estimator.run(*two_mass_data(4000, 0.05, 3))
    assert block.extra_names == estimator.extra_names == ("J_M", "J_L", "k", "c")
    expected = [TWO_MASS.J_M, TWO_MASS.J_L, TWO_MASS.k, TWO_MASS.c]
    apart = np.abs(np.log(block.extra[-1] / expected))
    assert (apart < [0.02, 0.2, 0.02, 0.05]).all(), apart


NOISE = 0.5
SAMPLES = 20_000


@pytest.mark.parametrize("name", ["oefo", "riv"])
def test_noise_on_the_output_does_not_bias_it(name: str) -> None:
    u, y, okay = CASES[name].data(SAMPLES, NOISE, 1)
    assert np.abs(CASES[name].make().run(u, y, okay).theta[-1] - LINEAR.theta).max() < 0.02


def test_noise_on_the_output_biases_least_squares_by_what_theory_says() -> None:
    u, y, okay = CASES["rls"].data(SAMPLES, NOISE, 1)
    theta = CASES["rls"].make().run(u, y, okay).theta[-1]
    x = LINEAR.simulate(u)
    rows = np.column_stack([-x[1:-1], -x[:-2], u[1:-1], u[:-2]])
    information = rows.T @ rows / rows.shape[0]
    noisy = information + np.diag([NOISE**2, NOISE**2, 0.0, 0.0])
    expected = np.linalg.solve(noisy, information @ LINEAR.theta)  # the noise's own power dilutes -y
    assert np.abs(expected - LINEAR.theta).max() > 0.1
    np.testing.assert_allclose(theta, expected, atol=0.03)


def test_the_extended_prediction_tells_the_noise_model() -> None:
    """White equation noise w: A y = B u + w, that is C = 1 and h = -a."""
    u, _, okay = CASES["oeepm"].data(SAMPLES, 0.0, 2)
    w = 0.3 * np.random.default_rng(2).normal(size=SAMPLES)
    noise = LinearModel(LINEAR.a, (1.0,), 0, LINEAR.sample_time_s).simulate(w)
    block = CASES["oeepm"].make().run(u, LINEAR.simulate(u) + noise, okay)
    np.testing.assert_allclose(block.theta[-1], LINEAR.theta, atol=0.02)
    assert block.extra_names == ("h_1", "h_2") == CASES["oeepm"].make().extra_names


def test_forty_percent_masked_samples_do_not_bias_it(case: Case) -> None:
    u, y, _ = case.data(6000, 0.02, 4)
    okay = np.random.default_rng(5).random(6000) > 0.4
    y = np.where(okay, y, 1e6)  # what is masked must not be looked at
    last = case.make().run(u, y, okay)[5999]
    assert last.status is Status.ESTIMATED
    np.testing.assert_allclose(last.theta, case.truth, rtol=0.02, atol=0.02)


def test_masked_samples_let_time_advance_and_nothing_else(case: Case) -> None:
    u, y, okay = case.data(300, 0.05, 0)
    estimator = case.make()
    estimator.run(u[:200], y[:200], okay[:200])
    theta = estimator.theta
    later = estimator.run(u[200:250], y[200:250], np.zeros(50, dtype=bool))
    np.testing.assert_allclose(estimator.theta, theta, rtol=1e-9)
    assert not later.used.any()
    assert not later.e_prior.any()
    assert not later.e_post.any()
    assert np.unique(later.y_hat).size > 10


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e31, -1e308])
def test_an_output_that_is_no_number_is_masked(case: Case, value: float) -> None:
    u, y, okay = case.data(300, 0.05, 0)
    masked, wrong = okay.copy(), y.copy()
    masked[150], wrong[150] = False, value
    assert np.array_equal(case.make().run(u, wrong, okay).theta, case.make().run(u, y, masked).theta)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e29, 1e31, 1e308, -1e308])
@pytest.mark.parametrize("where", ["u", "y", "both", "throughout"])
def test_nothing_makes_theta_not_a_number_and_nothing_raises(case: Case, value: float, where: str) -> None:
    u, y, okay = case.data(600, 0.05, 0)
    wrong = slice(0, 600, 7) if where == "throughout" else slice(200, 205)
    if where != "y":
        u[wrong] = value
    if where != "u":
        y[wrong] = value
    estimator = case.make()
    one_by_one(estimator, u[:250], y[:250], okay[:250])
    block = estimator.run(u[250:], y[250:], okay[250:])
    for values in (block.theta, block.y_hat, block.e_prior, block.e_post, block.extra, estimator.theta):
        assert np.isfinite(values).all()
    assert all(np.isfinite(part).all() for part in estimator.state().values() if isinstance(part, np.ndarray))


def test_after_a_burst_of_absurd_values_it_finds_back(case: Case) -> None:
    u, y, okay = case.data(8000, 0.0, 0)
    y[100:110] = 1e3 * np.abs(y).max()
    estimator = case.make(ConstantForgetting(0.98))
    np.testing.assert_allclose(estimator.run(u, y, okay).theta[-1], case.truth, rtol=0.05, atol=0.05)


def test_too_few_samples_are_said(case: Case) -> None:
    u, y, okay = case.data(30, 0.0, 0)
    last = case.make().run(u, y, okay)[29]
    assert last.reason is Reason.TOO_FEW_SAMPLES
    assert last.status is Status.UNESTIMATED
    masked = case.make().run(*case.data(300, 0.0, 0)[:2], np.zeros(300, dtype=bool))
    assert masked[299].reason is Reason.TOO_FEW_SAMPLES


NOISY = np.random.default_rng(1).normal(size=1000)
SIGNALS = {
    "nothing moves": (np.zeros(1000), np.zeros(1000), Reason.NOT_EXCITED),
    "both constant": (np.full(1000, 50.0), np.full(1000, 20.0), Reason.NOT_EXCITED),
    "a constant torque and a noisy speed": (np.full(1000, 1.0), NOISY, Reason.NOT_EXCITED),
    "a dead sensor": (NOISY, np.zeros(1000), Reason.CONSTANT_OUTPUT),
}
CURES = {Reason.NOT_EXCITED: "switch the PRBS on", Reason.CONSTANT_OUTPUT: "check the sensor"}


@pytest.mark.parametrize("name", list(SIGNALS))
def test_without_excitation_it_names_what_is_not_determined_and_the_cure(case: Case, name: str) -> None:
    u, y, reason = SIGNALS[name]
    estimator = case.make()
    last = estimator.run(u, y, np.ones(1000, dtype=bool))[999]
    assert last.reason is reason
    assert last.status is Status.UNESTIMATED
    text = estimator.statement(last.reason)
    assert estimator.undetermined
    assert all(each in text for each in estimator.undetermined)
    assert CURES[reason] in text


def test_signals_of_different_lengths_are_refused(case: Case) -> None:
    with pytest.raises(BadShape, match=rf"{case.name}: .*\(5,\), \(4,\), \(5,\)"):
        case.make().run(np.zeros(5), np.zeros(4), np.ones(5, dtype=bool))


def test_memory_does_not_grow(case: Case) -> None:
    u, y, okay = case.data(2000, 0.05, 0)
    estimator = case.make()
    one_by_one(estimator, u[:500], y[:500], okay[:500])
    sizes = {name: np.asarray(part).nbytes for name, part in estimator.state().items()}
    tracemalloc.start()
    seen = []
    for _ in range(3):
        for a, b in zip(u.tolist(), y.tolist(), strict=True):
            estimator.update(a, b)
        seen.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert seen[2] - seen[1] < 2000, seen  # one byte per sample would be 2000
    assert {name: np.asarray(part).nbytes for name, part in estimator.state().items()} == sizes


def through_npz(state: dict[str, object]) -> dict[str, object]:
    file = BytesIO()
    np.savez(file, **state)  # type: ignore[arg-type]
    file.seek(0)
    return dict(np.load(file))


def through_json(state: dict[str, object]) -> dict[str, object]:
    plain = {name: part.tolist() if isinstance(part, np.ndarray) else part for name, part in state.items()}
    return dict(json.loads(json.dumps(plain)))


@pytest.mark.parametrize("carried", [dict, through_npz, through_json])
def test_a_restored_state_continues_to_the_bit(case: Case, carried: type) -> None:
    u, y, okay = case.data(500, 0.05, 0)
    okay[248:252] = False  # in the middle of a gap, where everything that is remembered counts
    straight, first, second = case.make(), case.make(), case.make()
    whole = straight.run(u, y, okay)
    first.run(u[:250], y[:250], okay[:250])
    state = first.state()
    first.run(u[250:], y[250:], okay[250:])  # a state is a copy
    second.restore(carried(state))
    rest = second.run(u[250:], y[250:], okay[250:])
    assert np.array_equal(rest.theta, whole.theta[250:])
    assert np.array_equal(rest.y_hat, whole.y_hat[250:])
    assert np.array_equal(rest.reason, whole.reason[250:])
    assert same_state(second, straight)


@pytest.mark.parametrize(
    ("key", "value", "named"),
    [
        ("estimator", "other", "estimator is other, expected"),
        ("version", 99, "version is 99, expected 2"),
        ("structure", np.zeros(7), "structure is"),
        ("law", np.ones(3), "law is"),
        ("theta", np.ones(99), r"theta is of shape \(99,\), expected shape"),
        ("theta", "text", "theta holds 'text', expected numbers"),
        ("D", np.nan, "D is of shape"),
        ("live", None, "live is missing, expected"),
    ],
)
def test_a_state_that_does_not_fit_is_refused_and_nothing_is_changed(
    case: Case, key: str, value: object, named: str
) -> None:
    u, y, okay = case.data(100, 0.05, 0)
    estimator = case.make()
    estimator.run(u, y, okay)
    state = estimator.state()
    if value is None:
        del state[key]
    else:
        state[key] = value
    before = estimator.state()
    with pytest.raises(BadSetting, match=named):
        estimator.restore(state)
    assert all(np.array_equal(before[name], part) for name, part in estimator.state().items())


def test_a_state_with_a_hole_is_refused(case: Case) -> None:
    state = case.make().state()
    state["theta"] = np.full_like(state["theta"], np.nan)
    with pytest.raises(BadSetting, match="theta is not finite"):
        case.make().restore(state)


def test_the_kalman_filter_asks_for_its_start_values() -> None:
    with pytest.raises(BadModel, match="no start values for J_M, J_L, k and c"):
        ESTIMATORS["ekf"](Setup())
