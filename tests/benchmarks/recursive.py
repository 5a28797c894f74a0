"""Speed of the recursive estimators: next to the same algorithm in C, next to padasip, sample by sample, in replay.

``python -m tests.benchmarks.recursive [update] [padasip] [single] [replay] [memory] [--pairs N] [--padasip PYTHON]``

One update is at the paper's orders, na = nb = 4. padasip is looked for in this Python and, with ``--padasip``, in the
one of another environment::

    python -m venv /tmp/peers && /tmp/peers/bin/pip install padasip==1.2.2
    python -m tests.benchmarks.recursive --padasip /tmp/peers/bin/python
"""

import argparse
import importlib.util
import json
import os
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from types import MappingProxyType

import numpy as np

from estimator.identification.online.adaptation import DecreasingGain, DecreasingThenConstantTrace
from estimator.identification.online.ekf import TwoMass
from estimator.identification.online.estimators import ESTIMATORS, Oefo, Rls, Setup
from estimator.identification.online.recursive import RecursiveEstimator, Trajectory
from estimator.identification.settings import Settings
from estimator.signals.record import FloatArray, Record
from hil.rig.live import Pace, play_record, tracking_settings
from tests.benchmarks import recursive_c, recursive_padasip
from tests.benchmarks.ratios import Comparison, Taken, compare, machine, table, timed
from tests.benchmarks.recursive_data import MODEL, Data, data, regressors

START_UP = 80
BLOCK = 1000
"""Samples of a block: about the paper's N, and little enough that no memory is asked of the system for each."""

BLOCKS = 100
PEER_SAMPLES = 100_000

HINT = "python -m venv /tmp/peers && /tmp/peers/bin/pip install padasip==1.2.2, then --padasip /tmp/peers/bin/python"
COLUMNS = ("one update", "next to", "here", "there", "ratio", "pair by pair", "limit")
FIXED = tuple(
    f"-D{name}={value}"
    for name, value in (("NA", MODEL.orders.na), ("NB", MODEL.orders.nb), ("NK", MODEL.orders.nk), ("NL", MODEL.A.size))
)
NATIVE = "-march=native"
C: Mapping[str, tuple[tuple[str, ...], str]] = MappingProxyType(
    {
        "C, gcc -O3": ((), "at most 2"),
        "C, gcc -O3 -march=native": ((NATIVE,), "at most 2"),
        "C of fixed size, the same guards": (FIXED, "at most 1.1"),
        "C of fixed size, without guards": ((*FIXED, "-DPLAIN"), "at most 1.1"),
        "C of fixed size, without guards, -march=native": ((*FIXED, "-DPLAIN", NATIVE), "at most 1.1"),
    }
)
"""What OEFO is compared with: how it is compiled, and the limit."""


def oefo() -> Oefo:
    """Return the paper's estimator with its filter."""
    return Oefo(MODEL.A, MODEL.orders, DecreasingThenConstantTrace(), start_up_samples=START_UP)


def again_and_again(estimator: RecursiveEstimator, samples: Data, times: int) -> Callable[[], Trajectory]:
    """Return the run through the samples, so many times one after the other."""

    def run() -> Trajectory:
        for _ in range(times):
            last = estimator.run(*samples)
        return last

    return run


def against_c(pairs: int, samples: Data, times: int, flags: Sequence[str] = ()) -> Comparison:
    """Compare OEFO on a block with the same algorithm in C, in turn."""
    ours = again_and_again(oefo(), samples, times)
    law = DecreasingThenConstantTrace().law
    with recursive_c.compiled(*flags) as run:

        def theirs() -> FloatArray:
            for _ in range(times):
                last = run(MODEL.orders, MODEL.A, law, START_UP, *samples)
            return last

        ours(), theirs()
        return compare(ours, theirs, pairs)


def python_with_padasip(given: str | None) -> str | None:
    """Return a Python that has padasip: the one given, or this one."""
    if given is not None:
        return given
    return sys.executable if importlib.util.find_spec("padasip") else None


def padasip_took(python: str, folder: Path, samples: Data) -> Taken:
    """Return what padasip's filter took in a process of its own, its libraries on one thread as ours is."""
    path = folder / "data.npz"
    np.savez(path, x=regressors(*samples[:2]), y=samples[1])
    one_thread = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    command = [python, recursive_padasip.__file__, str(path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=one_thread)
    return Taken(*json.loads(done.stdout)["taken_s"])


def against_padasip(pairs: int, python: str, estimator: RecursiveEstimator) -> Comparison:
    """Compare an estimator on blocks with padasip's recursive least squares, in turn."""
    ours = again_and_again(estimator, data(BLOCK), PEER_SAMPLES // BLOCK)
    samples = data(PEER_SAMPLES)
    ours()
    with TemporaryDirectory(prefix="hil-padasip-") as folder:
        both = [(timed(ours)[0], padasip_took(python, Path(folder), samples)) for _ in range(pairs)]
    return Comparison(tuple(mine for mine, _ in both), tuple(other for _, other in both), None, None)


def per_sample(
    comparison: Comparison, n: int, what: str, companion: str, limit: str, *, inverse: bool
) -> tuple[str, ...]:
    """Return a line of the table: processor time per sample, and the ratio as the limit counts it."""
    here, there = (median(each.processor_s for each in side) / n * 1e6 for side in (comparison.ours, comparison.theirs))
    ratio, (low, high) = comparison.processor_ratio, comparison.spread
    if inverse:
        ratio, low, high = 1 / ratio, 1 / high, 1 / low
    return (what, companion, f"{here:.3g} us", f"{there:.3g} us", f"{ratio:.3g}", f"{low:.3g} to {high:.3g}", limit)


def update(pairs: int) -> list[tuple[str, ...]]:
    """Return the lines of OEFO next to C."""
    lines = []
    for companion, (flags, limit) in C.items():
        comparison = against_c(pairs, data(BLOCK), BLOCKS, flags)
        lines.append(per_sample(comparison, BLOCK * BLOCKS, "OEFO, in blocks", companion, limit, inverse=True))
    return lines


def padasip(pairs: int, given: str | None) -> list[tuple[str, ...]]:
    """Return the lines of RLS and OEFO next to padasip's RLS; none, and a hint, where there is no padasip."""
    python = python_with_padasip(given)
    if python is None:
        sys.stderr.write(f"padasip: expected it in this Python or in another, got neither. {HINT}\n")
        return []
    lines = []
    for estimator in (Rls(MODEL.orders, DecreasingGain()), oefo()):
        comparison = against_padasip(pairs, python, estimator)
        what = f"{estimator.name.upper()}, in blocks"
        lines.append(per_sample(comparison, PEER_SAMPLES, what, "padasip's RLS", "at least 100", inverse=False))
    return lines


def one_by_one(estimator: RecursiveEstimator, samples: Data) -> Taken:
    """Return what taking samples one by one from Python takes."""
    pairs = list(zip(samples[0].tolist(), samples[1].tolist(), strict=True))

    def job() -> None:
        for u, y in pairs:
            estimator.update(u, y)

    return timed(job)[0]


def single(pairs: int, n: int = 20_000) -> list[tuple[str, ...]]:
    """Return the time of an update sample by sample, of every estimator."""
    setup = Setup(MODEL.orders, L=MODEL.A, start_up_samples=START_UP, two_mass=TwoMass(1.6, 100.0, 4200.0, 9.0))
    lines: list[tuple[str, ...]] = []
    for name, entry in ESTIMATORS.items():
        estimator = entry(setup)
        taken = [one_by_one(estimator, data(n)).processor_s / n * 1e6 for _ in range(pairs)]
        blocks = again_and_again(entry(setup), data(BLOCK), n // BLOCK)
        block = [timed(blocks)[0].processor_s / n * 1e6 for _ in range(pairs)]
        lines.append((name, f"{median(taken):.3g} us", f"{median(block):.3g} us"))
    return lines


def replay(pairs: int, n: int = 1_000_000) -> list[tuple[str, str]]:
    """Return samples per second of processor time: the estimator alone, and a recording as ``hil replay`` plays it.

    That is every sample through high-pass, decimation from 10 to 20 ms, OEFO, resonance and watch, with the course kept
    for its file; with the paper's filter and settings, and as a run without a batch model has it.
    """
    u, y, okay = data(n)
    time_s: FloatArray = 0.01 * np.arange(n, dtype=np.float64)
    record = Record("benchmark", 0.01, time_s, u[:, np.newaxis], y, okay)
    jobs: dict[str, Callable[[], object]] = {"OEFO": again_and_again(oefo(), data(BLOCK), n // BLOCK)}
    for what, settings, L in (("paper", Settings(), MODEL.A), ("tracking, filter adapted", tracking_settings(), None)):
        jobs[f"the whole chain, {what}"] = partial(play_record, record, settings, Pace(), lambda course, now_s: None, L)
    return [
        (what, f"{n / median(timed(job)[0].processor_s for _ in range(pairs)) / 1e6:.3g} million samples/s")
        for what, job in jobs.items()
    ]


def memory(blocks: Sequence[int] = (10, 100, 1000)) -> list[tuple[str, str]]:
    """Return the peak of memory that a stream of so many blocks takes, handed over block by block."""
    u, y, okay = data(BLOCK)
    lines = []
    for count in blocks:
        estimator = oefo()
        tracemalloc.start()
        for _ in range(count):
            estimator.run(u, y, okay)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        lines.append((f"{count * BLOCK}", f"{peak / 1024:.0f} KiB"))
    return lines


def main() -> None:
    """Print what is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parts = ("update", "padasip", "single", "replay", "memory")
    parser.add_argument("parts", nargs="*", choices=[*parts, []], help="all by default")
    parser.add_argument("--pairs", type=int, default=7)
    parser.add_argument("--padasip", metavar="PYTHON", help="a Python that has padasip")
    given = parser.parse_args()
    wanted = given.parts or parts
    lines = update(given.pairs) if "update" in wanted else []
    if "padasip" in wanted:
        lines += padasip(given.pairs, given.padasip)
    tables = [table(COLUMNS, lines)] if lines else []
    if "single" in wanted:
        tables.append(table(("estimator", "sample by sample", "in a block"), single(given.pairs)))
    if "replay" in wanted:
        tables.append(table(("replay through", "rate of processor time"), replay(given.pairs)))
    if "memory" in wanted:
        tables.append(table(("samples of a stream", "peak memory"), memory()))
    sys.stdout.write(machine() + "\n" + "\n".join(tables))


if __name__ == "__main__":
    main()
