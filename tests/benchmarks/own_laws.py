"""``python -m tests.benchmarks.own_laws``: a simulation under a user's own law, next to one of the catalogue."""

import argparse
import sys
from collections.abc import Callable, Sequence

from estimator.physics.layout import Grid, flat_values, named
from estimator.physics.model import Structure
from estimator.physics.own_law import OwnLaw
from estimator.physics.simulate import simulate
from tests.benchmarks.ratios import compare, machine, table
from tests.estimator.physics import bench
from tests.estimator.physics.test_own_law import START, law, square

SAMPLES = 3000
SIMULATIONS = 20
"""Simulations that are timed as one: a single one is too short for a clock."""


def called_back(t: float, w: float, load: float, twist: float, torque: float, size: float) -> float:
    """Do what ``square`` does, with a text in between, which numba can't compile."""
    return size * float(f"{w!r}") * abs(w)


def simulations(effects: dict[str, dict[str, float]], *laws: OwnLaw) -> Callable[[], None]:
    """Return a job: a recording of 30 s, simulated some times."""
    names = named(laws)
    record = bench.record(bench.random_steps(SAMPLES, 1))
    grid, p = Grid(Structure.TWO_MASS, 2, 0.02, names), flat_values(bench.TWO_MASS, effects, names)

    def job() -> None:
        for _ in range(SIMULATIONS):
            simulate(grid, record, p, START)

    job()
    return job


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.own_laws")
    parser.add_argument("--pairs", type=int, default=5)
    pairs = parser.parse_args(arguments).pairs
    built_in = simulations({"quadratic_friction": {"quadratic_nm_s2": 0.01}})
    rows = []
    for what, function in (("compiled", square), ("called back in Python", called_back)):
        mine = simulations({"mine": {"size": 0.01}}, law(function))
        found = compare(built_in, mine, pairs)
        rows.append((what, f"{found.processor_ratio:.3g}", f"{found.ratio:.3g}"))
    sys.stdout.write(machine() + "\n" + table(("a user's law", "processor time", "time taken"), rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
