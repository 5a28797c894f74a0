"""``python -m tests.benchmarks.paper --seeds A..B --out DIR``: the figures of ``hil paper`` over several seeds.

Each seed drives its eight experiments over CANopen and Modbus. The first table has the errors of all of them: their
mean, which is the bias, with its standard error, and how often the two responses agree. The second has the bias of the
damping on line by the trace at which tr F is held and by N, the samples at which the model is read.
``DIR/paper.jsonl`` has a line for each experiment; called again, it continues.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from estimator.identification.chain import OnlineChain
from estimator.identification.online.adaptation import DecreasingThenConstantTrace
from estimator.identification.settings import Settings
from hil.cli.paper import EXPERIMENTS, PAPER_PERIOD_S
from hil.figures.local_model import LocalModel, row_of
from hil.figures.road import drive_all, driven_models
from hil.rig.stop import StopRequest
from tests.benchmarks.ratios import table
from tests.campaigns.worlds import parse_seeds

SECONDS = 30.0
TRACES, COUNTS = (0.001, 0.01, 0.1), (512, 1024, 1450)
"""Of F, the paper's in the middle, and of samples; the filters take some of the 1500 of 30 s."""

SETTINGS = Settings(offline_sample_time_s=PAPER_PERIOD_S)

Row = dict[str, Any]


def rows_of(seed: int) -> Iterator[Row]:
    """Drive the experiments of a seed and yield what comes of each."""
    with tempfile.TemporaryDirectory(prefix="hil-paper-") as place:
        driven = drive_all(Path(place), seed, EXPERIMENTS, SECONDS, StopRequest())
        for number, model in enumerate(driven_models(driven, SETTINGS)):
            row = row_of(model)
            yield {
                "seed": seed,
                "run": number + 1,
                "on line, frequency": row.online_hz / row.reference_hz - 1.0,
                "on line, damping": row.online_damping / row.reference_damping - 1.0,
                "off line, frequency": row.offline_hz / row.reference_hz - 1.0,
                "off line, damping": row.offline_damping / row.reference_damping - 1.0,
                "difference_db": row.offline_db,
                "traces": by_trace(model, row.reference_damping),
            }


def by_trace(model: LocalModel, damping: float) -> dict[str, list[float | None]]:
    """Return the error of the damping on line by trace, at each of `COUNTS`; None where there is no resonance."""
    found = {}
    for trace in TRACES:
        settings = replace(SETTINGS, adaptation=DecreasingThenConstantTrace(trace=trace), samples=None)
        course = OnlineChain(settings, model.record.sample_time_s, model.found.L).run(model.record)
        at = [course[min(count, len(course)) - 1].resonance for count in COUNTS]
        found[f"{trace:g}"] = [None if mode is None else mode.damping / damping - 1.0 for mode in at]
    return found


def _cells(errors: Sequence[float]) -> tuple[str, str, str]:
    """Return bias with its standard error, RMS and largest, in per cent."""
    e = 100.0 * np.array([each for each in errors if each is not None and np.isfinite(each)])
    return f"{e.mean():+.2f} ± {e.std(ddof=1) / np.sqrt(e.size):.2f} %", f"{_rms(e):.2f} %", f"{abs(e).max():.2f} %"


def _rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def report(rows: Sequence[Row]) -> str:
    """Return both tables."""
    wheres = [f"{where}, {what}" for where in ("on line", "off line") for what in ("frequency", "damping")]
    lines = [(where, *_cells([row[where] for row in rows])) for where in wheres]
    errors = table((f"of {len(rows)} experiments", "bias", "RMS error", "largest"), lines)
    difference_db = np.array([row["difference_db"] for row in rows])
    agree = (
        f"Responses that differ by at most 1 dB: {np.sum(difference_db <= 1.0)} of {difference_db.size}; "
        f"the largest difference {difference_db.max():.1f} dB.\n"
    )
    kept = [
        (f"{trace:g}", *(_cells([row["traces"][f"{trace:g}"][k] for row in rows])[0] for k in range(len(COUNTS))))
        for trace in TRACES
    ]
    head = ("damping on line: trace of F", *(f"N = {count}" for count in COUNTS))
    return f"{errors}\n{agree}\n{table(head, kept)}"


def main() -> int:
    """Drive what is not driven yet, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=parse_seeds, required=True)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    path = asked.out / "paper.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    known = {row["seed"] for row in rows}
    for seed in asked.seeds:
        if seed not in known:
            new = list(rows_of(seed))
            rows += new
            with path.open("a", encoding="utf-8") as file:
                file.writelines(json.dumps(row) + "\n" for row in new)
    sys.stdout.write(report([row for row in rows if row["seed"] in asked.seeds]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
