"""``python -m tests.benchmarks.diagnosis``: what a whole diagnosis takes: time next to scipy's fit, growth, memory.

Time is reported as a share of what scipy takes for the fit of the nominal parameters alone (``tests.benchmarks.fit``),
in turn. Growth is that of processor time, both cores together, because it does not count what else the machine does:
the exponent between two lengths, 1 for a time in proportion. Memory is the peak of a process of its own.
"""

import argparse
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.result import Diagnosis
from tests.benchmarks.cases import NOTHING, Case, make
from tests.benchmarks.fit import SEED, fit_by_scipy, problem_of
from tests.benchmarks.memory import write_case
from tests.benchmarks.ratios import COLUMNS, compare, machine, table, timed

PAIRS = 3
EFFECTS = (NOTHING, "backlash", "road_grade")
"""Hidden for the times: nothing, a single effect at a place, and a single one that is a course over time."""

LENGTHS_S = (15.0, 30.0, 60.0, 120.0)
GROWING = (NOTHING, "road_grade")
"""Hidden for the growth: the number of unknowns of a course over time grows with the recordings."""

HOUR_S, READS_PER_PERIOD = 3600.0, 10
"""Of all recordings together; readings in 10 ms: 1 kHz."""


def verdict_of(diagnosis: Diagnosis) -> str:
    """Return a verdict in a few words."""
    return ", ".join(effect.name for effect in diagnosis.effects) or diagnosis.verdict.value


def times(pairs: int) -> str:
    """Compare the diagnosis of three 30 s recordings with scipy's fit of them."""
    rows = []
    for effect in EFFECTS:
        case = make(effect, SEED)
        problem = problem_of(case)
        diagnose(case.records, case.model)  # compiles, or reads what was compiled
        both = compare(lambda c=case: diagnose(c.records, c.model), lambda p=problem: fit_by_scipy(p), pairs)
        rows.append((*both.row(f"diagnosis, {effect} hidden"), verdict_of(both.our_result)))
    return table((*COLUMNS, "verdict"), rows)


def growth(lengths_s: Sequence[float]) -> str:
    """Diagnose recordings of several lengths and return how the time grows, step by step."""
    rows = []
    for effect in GROWING:
        cases = [make(effect, SEED, length_s) for length_s in lengths_s]
        diagnose(cases[0].records, cases[0].model)  # compiles, or reads what was compiled
        done = [timed(lambda c=case: diagnose(c.records, c.model)) for case in cases]
        taken = [each for each, _ in done]
        exponents = [
            math.log(b.processor_s / a.processor_s) / math.log(long / short)
            for (short, a), (long, b) in pairwise(zip(lengths_s, taken, strict=True))
        ]
        overall = float(np.polyfit(np.log(lengths_s), np.log([each.processor_s for each in taken]), 1)[0])
        steps = ["", *(f"{exponent:.2f}" for exponent in exponents)]
        for length_s, (each, result), step in zip(lengths_s, done, steps, strict=True):
            times = f"{each.processor_s:.3g} s", f"{each.clock_s:.3g} s"
            rows.append((effect, f"3 × {length_s:g} s", *times, step, verdict_of(result)))
        rows.append((effect, "all, fitted", "", "", f"{overall:.2f}", ""))
    return table(("hidden", "recordings", "processor time", "time", "exponent", "verdict"), rows)


def memory(case: Case) -> str:
    """Diagnose a case in a fresh process and return its peak memory."""
    with tempfile.TemporaryDirectory(prefix="hil-memory-") as folder:
        path = Path(folder) / "case.npz"
        write_case(path, case)
        command = [sys.executable, "-m", "tests.benchmarks.memory", str(path)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    found = json.loads(done.stdout)
    samples = sum(record.time_s.size for record in case.records)
    row = (
        f"{len(case.records)} × {case.records[0].time_s.size * case.records[0].sample_time_s:g} s, {samples} samples",
        f"{found['loaded_mib']:.0f} MiB",
        f"{found['peak_mib']:.0f} MiB",
        found["verdict"],
    )
    return table(("recordings", "program and data", "peak", "verdict"), [row])


def hour() -> Case:
    """Record an hour at 1 kHz, the three tests 20 minutes each."""
    return make(NOTHING, SEED, HOUR_S / 3.0, READS_PER_PERIOD)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and write the report; return the exit status."""
    parts: dict[str, Callable[[argparse.Namespace], str]] = {
        "time": lambda options: times(options.pairs),
        "growth": lambda options: growth(LENGTHS_S),
        "memory": lambda options: memory(hour()),
    }
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.diagnosis", description="Time, growth and memory of a whole diagnosis."
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"{', '.join(parts)} (default: all)")
    parser.add_argument("--pairs", type=int, default=PAIRS, help="times each is done (default: %(default)s)")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.parts if name not in parts]
    if unknown:
        parser.error(f"expected {', '.join(parts)}, got {', '.join(unknown)}")
    sys.stdout.write(machine())
    for name in options.parts or parts:
        sys.stdout.write(f"\n### {name.capitalize()}\n\n{parts[name](options)}")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
