"""Work on all cores: order, nesting and exceptions are those of a plain loop."""

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from estimator.physics.jacobian import jacobian_at
from estimator.physics.parallel import concurrently, work_on, workers
from estimator.physics.problem import make_problem, outputs_at, start_vector
from estimator.physics.unknowns import nominal_unknowns
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record


@pytest.fixture(autouse=True)
def cores() -> Iterator[None]:
    """Work on two cores, whatever the machine has."""
    before = workers()
    work_on(2)
    yield
    work_on(before)


class Broken(Exception):
    """An item that can't be worked on."""


def test_results_come_in_the_order_of_the_items() -> None:
    """The first item can't end before the last has begun."""
    last_began = threading.Event()

    def work(item: int) -> int:
        if item == 0:
            assert last_began.wait(60.0)
        if item == 5:
            last_began.set()
        return item**2

    assert concurrently(work, range(6)) == [item**2 for item in range(6)]


def test_calls_inside_calls_never_work_on_more_than_so_many_at_once() -> None:
    """More of them than workers, each with calls inside, that wait for each other must not wait for ever."""
    lock, working, most = threading.Lock(), set[int](), 0

    def leaf(item: int) -> int:
        nonlocal most
        with lock:
            working.add(threading.get_ident())
            most = max(most, len(working))
        time.sleep(0.001)
        with lock:
            working.discard(threading.get_ident())
        return item

    def outer(item: int) -> list[list[int]]:
        return concurrently(lambda inner: concurrently(leaf, [item, inner]), range(3))

    items = range(4 * workers())
    assert concurrently(outer, items) == [[[item, inner] for inner in range(3)] for item in items]
    assert most == workers()


def test_an_idle_core_helps_inside_the_last_long_call() -> None:
    """As soon as nothing else is left: many short calls inside it are enough to see that."""
    threads = set[int]()

    def leaf(_: int) -> None:
        threads.add(threading.get_ident())
        time.sleep(0.001)

    concurrently(lambda item: concurrently(leaf, range(200 * item)), range(2))
    assert len(threads) == workers()


def test_an_exception_comes_out_and_the_next_call_works() -> None:
    def work(item: int) -> int:
        if item == 1:
            raise Broken(item)
        return item

    with pytest.raises(Broken, match="1"):
        concurrently(work, range(4))
    assert concurrently(lambda item: item + 1, range(4)) == [1, 2, 3, 4]


@pytest.mark.parametrize("count", [1, 3, 5])
def test_so_many_cores_as_were_asked_for_work(count: int) -> None:
    work_on(count)
    meeting = threading.Barrier(count, timeout=10.0)
    concurrently(lambda _: meeting.wait(), range(count))
    assert not meeting.broken
    assert workers() == count


def test_a_jacobian_is_the_same_to_the_last_bit_on_any_number_of_cores() -> None:
    torques = [random_steps(300, seed=seed) for seed in range(3)]
    records = [record(torque, np.cumsum(torque) * 1e-3, name=f"run_{i}") for i, torque in enumerate(torques)]
    line = model(TWO_MASS, effects={"backlash": {"gap_rad": 0.01}, "eddy_drag": {"peak_nm": 9.0, "peak_rad_s": 3.0}})
    problem = make_problem(line, records, nominal_unknowns(line))
    x = start_vector(problem)
    found = []
    for count in (1, 2, 5):
        work_on(count)
        outputs = outputs_at(problem, x)
        found.append((np.concatenate(outputs), jacobian_at(problem, x, outputs)))
    for outputs, derivative in found[1:]:
        np.testing.assert_array_equal(outputs, found[0][0])
        np.testing.assert_array_equal(derivative, found[0][1])
