"""Every method on every bus, in so many processes; each bus is driven once for all methods."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context

from tests.benchmarks.buses.drive import World
from tests.benchmarks.identification.answer import Answer, Method, make_case
from tests.benchmarks.identification.ours import OURS
from tests.benchmarks.identification.peers import PEERS

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Of linear algebra: one each, so that processor times compare."""

WARM_UP_SEED = 999_999
"""Of a bus that is not counted: with it compiled code is loaded."""


@dataclass(frozen=True, slots=True)
class Judged:
    """One bus: its seed, its truth and what each method said."""

    seed: int
    truth: Mapping[str, float]
    answers: Mapping[str, Answer]


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
    return Judged(seed, case.truth, answers)


def judge_all(seeds: Sequence[int], world: World, jobs: int) -> list[Judged]:
    """Ask every method about every bus."""
    os.environ.update(dict.fromkeys(THREADS, "1"))
    warm_up = partial(judge, WARM_UP_SEED, world)
    with ProcessPoolExecutor(jobs, get_context("spawn"), initializer=warm_up) as pool:
        return list(pool.map(partial(judge, world=world), seeds, chunksize=math.ceil(len(seeds) / (8 * jobs))))
