"""The benchmarks compare like with like: fits of one minimum, simulations of one accuracy. No time is judged."""

import shutil
from collections import Counter

import can
import numpy as np
import pytest

from estimator.identification.online.adaptation import DecreasingGain, DecreasingThenConstantTrace
from estimator.identification.online.estimators import Rls
from estimator.physics.fit import fit
from estimator.physics.problem import Problem
from hil.rig.pacing import FreePacer, period_ns
from tests.benchmarks import fieldbus as raw_can, recursive, recursive_c
from tests.benchmarks.cases import NOTHING, make
from tests.benchmarks.fieldbus import DEFAULT_PERIOD_S, armed, compiled, example_rig, lateness_ns, served_here
from tests.benchmarks.fit import ScipyFit, agreement, compare_simulations, fit_by_scipy, problem_of
from tests.benchmarks.recursive_data import MODEL, data, regressors

SHORT_S = 2.0


@pytest.fixture(scope="module")
def problem() -> Problem:
    return problem_of(make(NOTHING, seed=1, duration_s=SHORT_S, tests=1))


@pytest.fixture(scope="module")
def theirs(problem: Problem) -> ScipyFit:
    return fit_by_scipy(problem)


def test_both_fits_reach_the_same_minimum(problem: Problem, theirs: ScipyFit) -> None:
    apart = agreement(fit(problem), theirs)
    assert apart.likelihood < 0.1  # of a log-likelihood ratio: no conclusion changes
    assert apart.sigmas < 0.3


def test_both_simulations_are_as_exact(problem: Problem) -> None:
    simulated = compare_simulations(problem, pairs=1)
    assert simulated.our_error < 1e-3
    assert simulated.our_error / 5.0 < simulated.their_error < 5.0 * simulated.our_error


@pytest.mark.parametrize("flags", [(), recursive.FIXED], ids=["any orders", "fixed size"])
def test_the_c_is_the_same_algorithm(flags: tuple[str, ...]) -> None:
    u, y, okay = data(2000)
    okay[300:320] = False
    y[500], u[700] = np.nan, np.nan
    ours = recursive.oefo().run(u, y, okay)
    with recursive_c.compiled(*flags) as run:
        out = run(MODEL.orders, MODEL.A, DecreasingThenConstantTrace().law, recursive.START_UP, u, y, okay)
    n = MODEL.orders.n_parameters
    np.testing.assert_allclose(out[:, :n], ours.theta, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(out[:, n], ours.y_hat, rtol=1e-9, atol=1e-12)
    assert np.array_equal(out[:, n + 3] == 1.0, ours.used)
    assert np.array_equal(out[:, n + 4], ours.reason)


def test_least_squares_has_the_rows_that_padasip_is_given() -> None:
    u, y, okay = data(3000)
    rows = regressors(u, y)
    weighed = np.vstack([rows, np.eye(8) / np.sqrt(1000.0)])  # F(0) = 1000 I on both sides
    batch = np.linalg.lstsq(weighed, np.concatenate([y, np.zeros(8)]), rcond=None)[0]
    estimator = Rls(MODEL.orders, DecreasingGain())
    estimator.run(u, y, okay)
    np.testing.assert_allclose(estimator.theta, batch, rtol=1e-6)


def test_a_stream_ten_times_as_long_takes_no_more_memory() -> None:
    short, long = (float(peak.split()[0]) for _, peak in recursive.memory((3, 30)))
    assert long < 1.2 * short


CYCLES = 20
CYCLIC = {raw_can.SYNC, *raw_can.RPDOS, *raw_can.TPDOS}


def drained(bus: can.BusABC) -> Counter[int]:
    """Cyclic frames that wait on a bus, by identifier; heartbeats come when they come."""
    seen: Counter[int] = Counter()
    while (message := bus.recv(0.0)) is not None:
        seen[message.arbitration_id] += message.arbitration_id in CYCLIC
    return +seen


def test_both_sides_put_the_same_frames_on_the_bus() -> None:
    with served_here(example_rig(DEFAULT_PERIOD_S)) as rig:
        channel = rig.can.url.removeprefix("virtual:")
        with (
            can.Bus(interface="virtual", channel=channel, ignore_config=True) as listener,
            armed(rig, FreePacer(period_ns(rig.period_s))) as host,
        ):
            drained(listener)
            host.run(CYCLES, with_plc=False)
            ours = drained(listener)
    assert ours == Counter(dict.fromkeys(CYCLIC, CYCLES))


def test_raw_exchange_of_python_can_comes_to_its_end() -> None:
    with raw_can.raw_exchange() as exchange:
        exchange(CYCLES)


@pytest.mark.skipif(not (shutil.which("gcc") or shutil.which("cc")), reason="no C compiler (apt-get install gcc)")
def test_bare_loop_tells_the_lateness_of_every_cycle() -> None:
    with compiled() as program:
        late_ns = lateness_ns(program, 1_000_000, CYCLES, priority=0)
    assert len(late_ns) == CYCLES
    assert min(late_ns) >= 0  # it never begins a cycle before it is due
