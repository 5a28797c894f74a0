"""``python -m hil.proof.real [NAME...] --data DIR --out DIR``: the real recordings, asked and judged.

Every case's recordings are written where nothing else is, without the channels that would tell what is concealed;
`hil diagnose` is run there as any user would, and only then the truth is read. ``DIR/real.json`` has a case each, with
the verdict, the errors before and after on recordings that were not fitted, what agrees with what is known, and what
black boxes get. ``DIR/NAME/RUN/out`` has the diagnosis and its report. Called again, it continues where it was
interrupted.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

from hil.errors import HilError
from hil.proof.options import add_work_options, parse_work
from hil.proof.real.case_file import ROOM, CaseFile, RunEntry, case_folders, read_case
from hil.proof.real.judge import Agreement, median_agreement
from hil.proof.real.one_run import make_run
from hil.proof.real.prepare import require_recording
from hil.proof.real.result import FILE_NAME, RealResult, RunResult, write_results
from hil.proof.real.truth_file import read_truth

LIMIT_S = 3600.0
"""Time one command may take before its run counts as failed."""

_INTERRUPTED = 130

Progress = Callable[[str, float], None]


def _silent(_message: str, _share: float) -> None:
    """Report nothing."""


def run_real(
    data: Path,
    out: Path,
    names: Sequence[str] = (),
    jobs: int = 1,
    progress: Progress = _silent,
    *,
    room: Path = ROOM,
    limit_s: float = LIMIT_S,
) -> list[RealResult]:
    """Run real recordings through the public command and judge what it says.

    Parameters
    ----------
    data
        Folder of the recordings.
    out
        Gets ``real.json`` and a folder for each case and run.
    names
        Cases; all where none is named.
    jobs
        Runs at a time.
    progress
        Called with what was done and the share of all, after each run; an exception it raises ends the work.
    room
        Folder of the cases.
    limit_s
        Time for one command [s].

    Returns
    -------
    list of RealResult
        One per case, in the order asked for.

    Raises
    ------
    UsageError
        If there is no such case.
    RealFileError
        If a case's file is wrong, or a recording is not there or not the one that was meant.
    """
    folders = case_folders(list(names), room)
    cases = {name: read_case(folder) for name, folder in folders.items()}
    for case in cases.values():
        for entry in case.recordings.values():
            require_recording(data, entry)
    for folder in folders.values():
        read_truth(folder)  # a fault in it would show after hours otherwise
    out.mkdir(parents=True, exist_ok=True)
    done = _run_all(folders, cases, data, out, jobs, progress, limit_s)
    results = [_result(name, folders[name], case, done, out) for name, case in cases.items()]
    write_results(results, out / FILE_NAME)
    return results


def _run_all(
    folders: Mapping[str, Path],
    cases: Mapping[str, CaseFile],
    data: Path,
    out: Path,
    jobs: int,
    progress: Progress,
    limit_s: float,
) -> dict[tuple[str, str], RunResult]:
    pool = ThreadPoolExecutor(jobs)
    wanted: list[tuple[str, RunEntry]] = [(name, run) for name, case in cases.items() for run in case.runs]
    done: dict[tuple[str, str], RunResult] = {}
    try:
        running: dict[Future[RunResult], str] = {
            pool.submit(make_run, folders[name], cases[name], run, data, out / name / run.name, limit_s): name
            for name, run in wanted
        }
        for finished in as_completed(running):
            name, result = running[finished], finished.result()
            done[name, result.name] = result
            progress(f"{name} {result.name}: {_in_words(result)}", len(done) / len(wanted))
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
    return done


def _in_words(result: RunResult) -> str:
    if result.fault is not None:
        return f"failed, {result.fault}"
    return f"{result.verdict} ({', '.join(result.named) or 'nothing named'}), {result.duration_s:.0f} s"


def _result(
    name: str, folder: Path, case: CaseFile, done: Mapping[tuple[str, str], RunResult], out: Path
) -> RealResult:
    runs = [_placed(done[name, run.name], out, out / name / run.name) for run in case.runs]
    return RealResult(
        name=name,
        title=case.title,
        concealed=tuple(case.concealed),
        conceals=case.conceals,
        measure=case.measure.value,
        runs=tuple(runs),
        agreements=_over_runs(folder, runs),
    )


def _placed(run: RunResult, out: Path, folder: Path) -> RunResult:
    """Return a run whose paths start at the folder of ``real.json``."""
    if run.diagnosis is None or run.report is None:
        return run
    at = folder.relative_to(out)
    return replace(run, diagnosis=(at / run.diagnosis).as_posix(), report=(at / run.report).as_posix())


def _over_runs(folder: Path, runs: Sequence[RunResult]) -> tuple[Agreement, ...]:
    truth = read_truth(folder)
    if truth.grade is None:
        return ()
    what = f"correlation of the course found with the withheld one, {len(runs)} runs"
    return (median_agreement(what, "", [run.grade_correlation for run in runs], truth.grade.correlation),)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m hil.proof.real",
        description="Diagnose real recordings with part of their physics concealed, and judge by what is known.",
        epilog="Example: python -m hil.proof.real emps friction_joint --data recordings --out out/real",
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="cases (default: all)")
    parser.add_argument(
        "--data",
        type=Path,
        default=os.environ.get("HIL_DATA"),
        help="folder of the recordings (default: the environment's HIL_DATA)",
    )
    parser.add_argument("--out", required=True, type=Path, help=f"folder for {FILE_NAME} and the diagnoses")
    add_work_options(parser, LIMIT_S, "runs")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or resume; return the exit status."""
    parser = _parser()
    options = parse_work(parser, arguments)
    if options.data is None:
        parser.error("--data: expected the folder of the recordings, got neither it nor HIL_DATA")

    def tell(message: str, share: float) -> None:
        sys.stdout.write(f"[{share:4.0%}] {message}\n")
        sys.stdout.flush()

    try:
        run_real(Path(options.data), options.out, options.names, options.jobs, tell, limit_s=options.limit_s)
    except HilError as error:
        parser.error(str(error))
    except KeyboardInterrupt:
        return _INTERRUPTED
    sys.stdout.write(f"{options.out / FILE_NAME}\n")
    return 0
