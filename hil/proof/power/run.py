"""``python -m hil.proof.power --effects A,B --seeds A..B --out DIR``: how small an effect is found, next to the bound.

For every effect and seed the smallest sizes that the best possible tests find are computed from the noise-free truth;
then ``hil diagnose`` is run on multiples of one of them, with noise drawn anew each time. ``DIR/bounds.jsonl`` has a
line per bus, ``DIR/results.jsonl`` one per trial, ``DIR/summary.md``, ``DIR/summary.json`` and ``DIR/power.svg`` what
they add up to, ``DIR/cases/EFFECT/SEED/MULTIPLE`` the files of each trial. Called again, it continues where it was
interrupted; trials in which the command failed are run again.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any

from hil.errors import RecordingError, UsageError
from hil.proof.campaign.kinds import parse_seeds
from hil.proof.campaign.run import LIMIT_S, RESULTS, read_results
from hil.proof.campaign.statistics import Row
from hil.proof.options import add_work_options, parse_work
from hil.proof.power.bound import HYPOTHESES, LEVEL
from hil.proof.power.picture import power_svg
from hil.proof.power.report import markdown, summary
from hil.proof.power.sizes import SCALES, scale_of
from hil.proof.power.trial import LEAST_MULTIPLE, Study, attempt, kind_of, made_otherwise, measure
from hil.proof.truth.experiments import DURATION_S, PERIOD_S

BOUNDS = "bounds.jsonl"

MULTIPLES = (0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0)

_INTERRUPTED = 130

Rows = dict[tuple[str, int], Row]
Task = Callable[[], dict[str, Any]]


def appended(tasks: Sequence[Task], path: Path, workers: int) -> Iterator[dict[str, Any]]:
    """Yield the rows of tasks as they are done, each written to a file before.

    Parameters
    ----------
    tasks
        Give a row each, JSON types only.
    path
        File that gets a line for each.
    workers
        Tasks at a time.
    """
    pool = ThreadPoolExecutor(workers)
    try:
        for done in as_completed([pool.submit(task) for task in tasks]):
            row = done.result()
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row, allow_nan=False) + "\n")
            yield row
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def run_study(
    study: Study, buses: Sequence[tuple[str, int]], bounds: Rows, results: Rows, options: argparse.Namespace
) -> None:
    """Measure the buses that have no bound yet and run the trials that are missing; both rows grow as they are done."""
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    wanted = {f"{multiple:g}" for multiple in study.multiples}
    unmeasured = [bus for bus in buses if bus not in bounds or not wanted <= set(bounds[bus]["distances"])]
    _tell(f"{len(unmeasured)} bounds to compute, {len(buses) - len(unmeasured)} done before")
    measuring = [partial(measure, study, *bus) for bus in unmeasured]
    for row in appended(measuring, out / BOUNDS, options.jobs):
        bounds[row["kind"], row["seed"]] = row
        _tell(f"{row['kind']} {row['seed']}: bound {row['bound']['recorded']:.3g} {row['unit']}")
    finished = {key for key, row in results.items() if row["fault"] is None}
    planned = [(bus, multiple) for bus in buses for multiple in study.multiples]
    missing = [(bus, multiple) for bus, multiple in planned if (kind_of(bus[0], multiple), bus[1]) not in finished]
    _tell(f"{len(missing)} trials to run, {len(planned) - len(missing)} done before")
    trying = [partial(attempt, study, bounds[bus], multiple, out, options.limit_s) for bus, multiple in missing]
    for done, row in enumerate(appended(trying, out / RESULTS, options.jobs), start=1):
        results[row["kind"], row["seed"]] = row
        _tell(f"[{done}/{len(missing)}] {row['kind']} {row['seed']}: {_in_words(row)}, {row['diagnose_s']:.1f} s")


def _in_words(row: Row) -> str:
    named = row["fault"] or ", ".join(row["named"]) or row["verdict"]
    return f"{'found' if row['found'] else 'not found'} ({named})"


def _tell(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def write_summary(rows: Sequence[Row], bounds: Sequence[Row], out: Path) -> None:
    """Write ``summary.json``, ``summary.md`` and ``power.svg``."""
    data = summary(rows, bounds)
    (out / "summary.json").write_text(json.dumps(data, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (out / "summary.md").write_text(markdown(rows, bounds), encoding="utf-8")
    (out / "power.svg").write_text(power_svg(data["effects"]), encoding="utf-8")


def parse_effects(text: str) -> list[str]:
    """Return the effects of a list joined by commas, each once.

    Raises
    ------
    UsageError
        If one has no single size.
    """
    names = list(dict.fromkeys(word.strip() for word in text.split(",")))
    for name in names:
        scale_of(name)
    return names


def _multiples(text: str) -> tuple[float, ...]:
    try:
        multiples = tuple(float(word) for word in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected numbers with commas, got {text!r}") from None
    if min(multiples) < LEAST_MULTIPLE:
        raise argparse.ArgumentTypeError(f"expected {LEAST_MULTIPLE:g} or more each, got {text!r}")
    return multiples


def _alpha(text: str) -> float:
    alpha = float(text)
    if not 0.0 < alpha < 1.0:
        raise argparse.ArgumentTypeError(f"expected a probability between 0 and 1, got {text}")
    return alpha


def _samples(text: str) -> int:
    duration_s = float(text)
    if not 1.0 <= duration_s <= DURATION_S:
        raise argparse.ArgumentTypeError(f"expected 1 to {DURATION_S:g} s, got {text}")
    return round(duration_s / PERIOD_S)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m hil.proof.power",
        description="Find how small an effect the public command names, next to the best possible tests.",
        epilog="Example: python -m hil.proof.power --effects backlash --seeds 1..10 --out out/power",
    )
    parser.add_argument(
        "--effects", default=",".join(SCALES), help="those to try, with commas (default: %(default)s, all there are)"
    )
    parser.add_argument("--seeds", required=True, help="A..B, both included: one bus for each")
    parser.add_argument("--out", required=True, type=Path, help="folder for bounds, results, summary and cases")
    parser.add_argument(
        "--multiples",
        type=_multiples,
        default=MULTIPLES,
        help="sizes to try, over the bound of who has the recordings alone (default: "
        f"{','.join(f'{multiple:g}' for multiple in MULTIPLES)})",
    )
    parser.add_argument(
        "--alpha",
        type=_alpha,
        default=LEVEL / HYPOTHESES,
        help=f"level of the best test (default: {LEVEL:g} over the {HYPOTHESES} entries of the catalogue)",
    )
    parser.add_argument(
        "--duration-s", dest="samples", type=_samples, default=f"{DURATION_S:g}", help="of each recording"
    )
    add_work_options(parser, LIMIT_S, "trials")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or resume a study; return the exit status."""
    parser = _parser()
    options = parse_work(parser, arguments)
    study = Study(options.alpha, options.multiples, options.samples)
    try:
        buses = [(effect, seed) for seed in parse_seeds(options.seeds) for effect in parse_effects(options.effects)]
        bounds, results = (dict(read_results(options.out / name)) for name in (BOUNDS, RESULTS))
    except (UsageError, RecordingError) as error:
        parser.error(str(error))
    if (other := made_otherwise(study, [*bounds.values(), *results.values()])) is not None:
        parser.error(
            f"--out {options.out}: expected a study of alpha {study.alpha:g} and {study.samples} samples, got one of "
            f"{other['alpha']:g} and {other['samples']}. Choose another folder."
        )
    try:
        run_study(study, buses, bounds, results, options)
    except KeyboardInterrupt:
        return _INTERRUPTED
    finally:
        if options.out.exists():
            write_summary(list(results.values()), list(bounds.values()), options.out)
    _tell(f"{options.out / 'summary.md'}")
    return 0
