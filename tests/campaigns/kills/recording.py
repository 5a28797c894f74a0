"""A process that records, killed at some moment, and what is wrong with what it leaves."""

import multiprocessing
import time
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import Structure, c_int
from dataclasses import dataclass, field
from multiprocessing.context import ForkServerContext
from pathlib import Path
from typing import Any

from hil.errors import RecordingError
from hil.recording import RecordingWriter, columns, read_table
from hil.recording.writer import cells_of
from tests.recording.test_writer import sample

ROWS = 2000

PAUSE_S = 1e-4
"""Between two samples: a hundred times as fast as a rig at 10 ms."""

PATIENCE_S = 120.0

METADATA = {"rig": "bench", "experiment": "tip", "note": "x" * 2000}


class Progress(Structure):
    """What a recording process says of itself, in memory shared with whoever kills it.

    ``appended`` samples were handed over, of which the system had ``written`` at least; ``ended`` is 1 once the last
    one was handed over, and 2 when the recording has its name.
    """

    _fields_ = (("appended", c_int), ("written", c_int), ("ended", c_int))


@dataclass
class Left:
    """What a killed process left."""

    moment: str
    rows: int = 0
    lost: int = 0
    problems: list[str] = field(default_factory=list)


def prepared() -> ForkServerContext:
    """Return what starts recording processes: forked from one that has the libraries loaded and has used none."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.campaigns.kills.recording", "asammdf", "h5py"])
    return context


def record(path: Path, progress: Any, rows: int) -> None:
    """Record, as a run does."""
    with RecordingWriter(path, METADATA) as writer:
        for k in range(rows):
            writer.append(sample(k))
            progress.appended, progress.written = k + 1, writer.n_samples
            time.sleep(PAUSE_S)
        progress.ended = 1
    progress.ended = 2


@contextmanager
def recording(context: ForkServerContext, path: Path, rows: int = ROWS) -> Iterator[tuple[Any, Any]]:
    """Start a recording process; yields it and its progress, once it has begun."""
    progress = context.Value(Progress, lock=False)
    process = context.Process(target=record, args=(path, progress, rows))
    process.start()
    try:
        _await(lambda: progress.appended > 0)
        yield process, progress
    finally:
        process.kill()
        process.join()
        process.close()


def durations(context: ForkServerContext, path: Path) -> tuple[float, float]:
    """Record once without a kill; return how long writing and publishing take [s]."""
    with recording(context, path) as (process, progress):
        began_s = time.perf_counter()
        _await(lambda: progress.ended > 0)
        wrote_s = time.perf_counter()
        _await(lambda: progress.ended > 1)
        published_s = time.perf_counter()
        process.join(PATIENCE_S)
        if read_table(path).n_rows != ROWS:
            raise AssertionError(f"{path.name} without a kill is no recording")
        return wrote_s - began_s, published_s - wrote_s


def killed(context: ForkServerContext, path: Path, publishing: bool, after_s: float) -> Left:
    """Kill a recording process so long after its first sample, or after its last, and look at what it leaves."""
    with recording(context, path) as (process, progress):
        if publishing:
            _await(lambda: progress.ended > 0)
        time.sleep(after_s)
        written = progress.written
        process.kill()
        process.join()
        left = Left(("writing", "publishing", "after")[progress.ended])
        _judge(path, progress.appended, ROWS if progress.ended == 2 else written, left)
    return left


def _judge(path: Path, appended: int, written: int, left: Left) -> None:
    part = path.with_name(f"{path.stem}.part.csv")
    found = [each for each in (path, part) if each.exists()]
    if not found:
        left.problems.append(f"nothing is left of {written} rows")
    for each in found:
        try:
            table = read_table(each)
        except RecordingError as error:
            if each == part and written == 0:  # not even the header may have been written
                continue
            left.problems.append(str(error))
            continue
        left.rows = max(left.rows, table.n_rows)
        needed = ROWS if each == path else written
        if table.n_rows < needed:
            left.problems.append(f"{each.name} has {table.n_rows} rows of {needed}")
        left.problems += [f"{each.name}: {problem}" for problem in _other_cells(table.columns, table.n_rows)]
    left.lost = appended - left.rows
    own = {path.name, part.name, f"{path.name}.json", f"{part.name}.json"}
    foreign = {each.name for each in path.parent.iterdir()} - own
    left.problems += [f"{name} is left" for name in foreign if not name.startswith(f".{path.name}.")]


def _other_cells(found: Any, rows: int) -> Iterator[str]:
    """Name the columns whose cells are not those that were handed over."""
    expected = zip(*(cells_of(sample(k)) for k in range(rows)), strict=True)
    for name, cells in zip(columns.UNITS, expected, strict=True):
        if list(map(repr, map(float, cells))) != list(map(repr, map(float, found[name]))):
            yield f"column {name} is not what was recorded"


def _await(condition: Any) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > end_s:
            raise TimeoutError(f"a recording process said nothing for {PATIENCE_S:g} s")
        time.sleep(0.0005)
