"""Every method on every bus, in so many processes; ten healthy recordings, whose models must pass their own test."""

import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from types import MappingProxyType

from estimator.identification.linear_model import Orders
from estimator.identification.offline.fits import LinearFit, fit_box_jenkins, fit_output_error
from estimator.identification.offline.validation import validate
from estimator.identification.settings import Settings
from estimator.signals.decimate import decimate
from estimator.signals.record import Record
from tests.benchmarks.buses import CLEAN, ON_THE_ROAD, World, draw_bus, drive
from tests.benchmarks.identification.bound import least_errors
from tests.benchmarks.identification.methods import OURS, PEERS, Answer, Method, make_case
from tests.benchmarks.ratios import table

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Of linear algebra: one each, so that processor times compare."""

WARM_UP_SEED = 999_999
"""Of a bus that is not counted: with it compiled code is loaded."""


@dataclass(frozen=True, slots=True)
class Judged:
    """One bus: its seed, its truth, what each method said, and the least errors of frequency and damping, relative."""

    seed: int
    truth: Mapping[str, float]
    answers: Mapping[str, Answer]
    least: tuple[float, float]


def methods() -> dict[str, Method]:
    """Return the methods that can be run here by name, ours first."""
    ours = {f"this project: {name}": method for name, method in OURS.items()}
    return ours | {peer.name: peer for peer in PEERS if peer.is_installed}


def missing() -> list[str]:
    """Return what can't be run here, and how it could be."""
    return [f"{peer.name}: skipped, pip install {peer.requirement}" for peer in PEERS if not peer.is_installed]


def judge(seed: int, world: World) -> Judged:
    """Ask every method about one bus."""
    case = make_case(seed, world)
    answers = {}
    for name, method in methods().items():
        begun = time.process_time()
        answer = method(case)
        answers[name] = replace(answer, cpu_s=time.process_time() - begun)
    return Judged(seed, case.truth, answers, least_errors(case, world))


def judge_all(seeds: Sequence[int], world: World, jobs: int) -> list[Judged]:
    """Ask every method about every bus."""
    os.environ.update(dict.fromkeys(THREADS, "1"))
    warm_up = partial(judge, WARM_UP_SEED, world)
    with ProcessPoolExecutor(jobs, get_context("spawn"), initializer=warm_up) as pool:
        return list(pool.map(partial(judge, world=world), seeds, chunksize=math.ceil(len(seeds) / (8 * jobs))))


FIRST_SEED, COUNT = 5000, 10

Fit = Callable[[Record], tuple[LinearFit, Record]]


def recordings(world: World = CLEAN) -> Iterator[Record]:
    """Yield ten recordings of 30 s in which nothing is wrong, each of another bus."""
    for seed in range(FIRST_SEED, FIRST_SEED + COUNT):
        yield drive(draw_bus(seed), world=world)


def at_10_ms(record: Record) -> tuple[LinearFit, Record]:
    """Return the model at the recording's own period and the data it is of."""
    data = decimate(record, 1)
    return fit_box_jenkins(data, Orders(3, 3, 1)), data


def at_20_ms(record: Record) -> tuple[LinearFit, Record]:
    """Return the model at the paper's period and the data it is of."""
    data = decimate(record, Settings().factor(record))
    return fit_output_error(data), data


FITS: Mapping[str, Fit] = MappingProxyType({"Box-Jenkins, 10 ms": at_10_ms, "output error, 20 ms": at_20_ms})


def passed(world: World, fit: Fit) -> int:
    """Return how many of the ten models leave a residual that is independent of the past input."""
    fitted = (fit(record) for record in recordings(world))
    return sum(validate(model, data).independence.is_independent for model, data in fitted)


def healthy_table() -> str:
    """Tell how many pass."""
    worlds = {"clean": CLEAN, "on the road": ON_THE_ROAD}
    rows = [(name, *(f"{passed(world, fit)} of {COUNT}" for world in worlds.values())) for name, fit in FITS.items()]
    return table(("residual independent of the past torque", *worlds), rows)
