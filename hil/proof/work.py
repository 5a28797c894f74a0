"""Work on many cases: several at a time, kept as it comes, continued where it was interrupted."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, TypeVar

from hil.errors import UsageError
from hil.files import read_json, write_whole

Result = TypeVar("Result")

WorkProgress = Callable[[str, int, int], None]
"""Called with what has been done, how many of it, and how many there are in all; what it raises ends the work."""


def silent(what: str, done: int, total: int) -> None:
    """Report nothing."""


def work_on(
    names: Sequence[str],
    work: Callable[[str], Result],
    progress: WorkProgress = silent,
    *,
    jobs: int = 1,
    pool: Executor | None = None,
    known: Mapping[str, Result] | None = None,
    keep: Callable[[dict[str, Result]], object] = lambda done: None,
    said: str = "done",
) -> dict[str, Result]:
    """Return the result of each name, in the order given; the first error ends what has not begun."""
    done = {name: known[name] for name in names if name in known} if known else {}
    with pool or ThreadPoolExecutor(jobs) as workers:
        running = {workers.submit(work, name): name for name in names if name not in done}
        try:
            for finished in as_completed(running):
                done[running[finished]] = finished.result()
                keep(done)
                progress(f"{running[finished]} {said}", len(done), len(names))
        finally:
            for future in running:
                future.cancel()
    return {name: done[name] for name in names}


def read_entries(path: Path, schema: str, key: str, advice: str) -> Any:
    """Read what is under a key of a file of a schema; `UsageError`, with the advice, where it is none."""
    try:
        content = read_json(path)
    except OSError as error:
        raise UsageError(f"{path}: expected a list of cases, can't be read: {error.strerror}; {advice}") from error
    except ValueError as error:
        raise UsageError(f"{path}: expected JSON, got: {error}; {advice}") from error
    if not isinstance(content, dict) or content.get("schema") != schema or key not in content:
        raise UsageError(f"{path}: expected an object of schema {schema} with {key}; {advice}")
    return content[key]


def write_entries(path: Path, schema: str, key: str, entries: object) -> None:
    """Write entries as JSON; a reader finds the old ones or the new ones."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"schema": schema, key: entries}, indent=1, ensure_ascii=False, allow_nan=False)
    write_whole(path, f"{text}\n")
