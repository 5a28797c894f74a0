"""``python -m hil.proof.campaign --seeds A..B --kinds KINDS --out DIR``: many sealed cases, scored.

For every kind and seed a case is made, ``hil diagnose`` and ``hil simulate`` are run on it as any user would, and only
then its truth is written and held against the verdict. ``DIR/results.jsonl`` has a line per case, ``DIR/summary.md``,
``DIR/summary.json`` and ``DIR/confusion.svg`` have what they add up to, ``DIR/cases/KIND/SEED`` the files of each case.
Called again, it continues where it was interrupted; cases in which a command failed are run again.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from hil.errors import RecordingError, UsageError
from hil.files import parse_json
from hil.proof.campaign.band import score_band
from hil.proof.campaign.case import run_case
from hil.proof.campaign.kinds import ALL, Group, Kind, parse_kinds, parse_seeds
from hil.proof.campaign.matrix import confusion_of
from hil.proof.campaign.report import markdown, summary
from hil.proof.campaign.score import score
from hil.proof.campaign.statistics import Row
from hil.proof.options import add_work_options, parse_work

RESULTS = "results.jsonl"

LIMIT_S = 900.0
"""Time one command may take before its case counts as failed."""

_INTERRUPTED = 130

Job = tuple[Kind, int]


def read_results(path: Path) -> dict[tuple[str, int], Row]:
    """Return the rows of a results file by kind and seed; of a case that was run again, the last.

    Raises
    ------
    RecordingError
        If a line is no row, naming it.
    """
    rows: dict[tuple[str, int], Row] = {}
    if not path.exists():
        return rows
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        try:
            row = parse_json(line)
            rows[row["kind"], row["seed"]] = row
        except (ValueError, KeyError, TypeError) as error:
            raise RecordingError(
                path, f"line {number}: expected one case as JSON with kind and seed, got {line[:40]!r}. Remove it."
            ) from error
    return rows


def run_campaign(jobs: Sequence[Job], out: Path, workers: int, limit_s: float) -> Iterator[dict[str, Any]]:
    """Run cases and yield their rows as they are done, each written to the results file before.

    Parameters
    ----------
    jobs
        Kind and seed of each case.
    out
        Folder of the campaign.
    workers
        Cases at a time.
    limit_s
        Time for one command [s].
    """
    out.mkdir(parents=True, exist_ok=True)
    pool = ThreadPoolExecutor(workers)
    try:
        running = [pool.submit(_scored, planted, seed, out, limit_s) for planted, seed in jobs]
        for done in as_completed(running):
            row = done.result()
            with (out / RESULTS).open("a", encoding="utf-8") as file:
                file.write(json.dumps(row, allow_nan=False) + "\n")
            yield row
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _scored(planted: Kind, seed: int, out: Path, limit_s: float) -> dict[str, Any]:
    truth, answer = run_case(planted, seed, out / "cases" / planted.name / str(seed), limit_s)
    row = score(planted, seed, truth, answer)
    return {**row, "band": score_band(planted, seed, truth, answer.diagnosis)}


def write_summary(rows: Sequence[Row], out: Path) -> None:
    """Write ``summary.json``, ``summary.md`` and ``confusion.svg``, kinds in the order of the catalogue."""
    order = {known.name: place for place, known in enumerate(parse_kinds(ALL))}
    rows = sorted(rows, key=lambda row: (order.get(row["kind"], len(order)), row["kind"], row["seed"]))
    (out / "summary.json").write_text(json.dumps(summary(rows), indent=1) + "\n", encoding="utf-8")
    (out / "summary.md").write_text(markdown(rows), encoding="utf-8")
    (out / "confusion.svg").write_text(confusion_of(rows), encoding="utf-8")


def _in_words(row: Row, done: int, total: int) -> str:
    named = row["fault"] or ", ".join(row["named"]) or row["verdict"]
    return f"[{done}/{total}] {row['kind']} {row['seed']}: {row['outcome']} ({named}), {row['diagnose_s']:.1f} s"


def _parser() -> argparse.ArgumentParser:
    groups = ", ".join(group.value for group in Group)
    parser = argparse.ArgumentParser(
        prog="python -m hil.proof.campaign",
        description="Diagnose many sealed cases with the public command and score the verdicts.",
        epilog="Example: python -m hil.proof.campaign --seeds 1..20 --kinds single,none,off --out out/campaign",
    )
    parser.add_argument("--seeds", required=True, help="A..B, both included: one case of every kind for each")
    parser.add_argument(
        "--kinds", default=ALL, help=f"{ALL}, {groups}, effects, or several joined by +; a list with commas"
    )
    parser.add_argument("--out", required=True, type=Path, help="folder for results, summary and the cases' files")
    add_work_options(parser, LIMIT_S, "cases")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or resume a campaign; return the exit status."""
    parser = _parser()
    options = parse_work(parser, arguments)
    try:
        planned = [(wanted, seed) for seed in parse_seeds(options.seeds) for wanted in parse_kinds(options.kinds)]
        rows = read_results(options.out / RESULTS)
    except (UsageError, RecordingError) as error:
        parser.error(str(error))
    finished = {key for key, row in rows.items() if row["fault"] is None}
    jobs = [(wanted, seed) for wanted, seed in planned if (wanted.name, seed) not in finished]
    sys.stdout.write(f"{len(jobs)} cases to run, {len(planned) - len(jobs)} done before\n")
    try:
        for done, row in enumerate(run_campaign(jobs, options.out, options.jobs, options.limit_s), start=1):
            rows[row["kind"], row["seed"]] = row
            sys.stdout.write(_in_words(row, done, len(jobs)) + "\n")
            sys.stdout.flush()
    except KeyboardInterrupt:
        return _INTERRUPTED
    finally:
        write_summary(list(rows.values()), options.out)
    sys.stdout.write(f"{options.out / 'summary.md'}\n")
    return 0
