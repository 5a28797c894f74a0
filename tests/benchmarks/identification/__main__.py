"""How right the identified models are, over many buses, next to other tools.

``python -m tests.benchmarks.identification [buses] [clean] [healthy] [accuracy] [coverage] [truth] [paper]
[responses] [joint] [--buses N] ...``

``buses``     buses of the benchmarks' own on rough roads, with a driver: every method of ours and of the peers on the
              same data; errors, and how often printed intervals held the truth (by default)
``clean``     the same without road and driver
``healthy``   ten clean recordings, and the same ten on the road: how many pass the residual test of their own model
``accuracy``, ``coverage``, ``truth``, ``paper``   the drivelines of the tests and of the proof (``rigs.py``)
``responses``, ``joint``   frequency responses without a model, and one model of several recordings (``lines.py``)
"""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from tests.benchmarks.buses import CLEAN, ON_THE_ROAD, World
from tests.benchmarks.identification import lines, rigs
from tests.benchmarks.identification.run import healthy_table, judge_all, missing
from tests.benchmarks.identification.scores import document, tables
from tests.benchmarks.ratios import machine

BUSES, FIRST_SEED = 200, 0


def buses_part(options: argparse.Namespace, world: World, name: str) -> str:
    """Judge every method; write the JSON next to where it is wanted."""
    seeds = range(options.seed, options.seed + options.buses)
    judged = judge_all(seeds, world, options.jobs)
    if options.json is not None:
        settings = {"part": name, "first_seed": options.seed, "buses": options.buses}
        options.json.mkdir(parents=True, exist_ok=True)
        (options.json / f"{name}.json").write_text(json.dumps(document(judged, settings), indent=1, allow_nan=False))
    skipped = "".join(f"{line}\n" for line in missing())
    return f"Buses of seeds {seeds.start} to {seeds.stop - 1}. {machine()}{skipped}\n{tables(judged)}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Simulate, identify and write the report; return the exit status."""
    parts: dict[str, Callable[[argparse.Namespace], str]] = {
        "buses": partial(buses_part, world=ON_THE_ROAD, name="buses"),
        "clean": partial(buses_part, world=CLEAN, name="clean"),
        "healthy": lambda _: healthy_table(),
        "accuracy": lambda _: rigs.accuracy(),
        "coverage": lambda options: rigs.coverage_table(options.buses, rigs.cruises),
        "truth": lambda options: rigs.truth_part(options.buses),
        "responses": lambda options: lines.responses_table(options.buses),
        "joint": lambda options: lines.joint_table(options.buses),
        "paper": lambda options: rigs.coverage_table(options.buses, rigs.paper_rig),
    }
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.identification", description="How right the identified models are."
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"{', '.join(parts)} (default: buses)")
    parser.add_argument("--buses", type=int, default=BUSES, help="how many (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=FIRST_SEED, help="of the first bus (default: %(default)s)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default: %(default)s)")
    parser.add_argument("--json", type=Path, metavar="DIR", help="where PART.json is written")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.parts if name not in parts]
    if unknown:
        parser.error(f"expected {', '.join(parts)}, got {', '.join(unknown)}")
    if options.buses < 1 or options.jobs < 1:
        parser.error(f"--buses {options.buses}, --jobs {options.jobs}: expected 1 or more of each")
    for name in options.parts or ("buses",):
        sys.stdout.write(f"\n### {name.capitalize()}\n\n{parts[name](options)}")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
