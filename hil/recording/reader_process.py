"""The process that reads recordings for another one; see `hil.recording.sandbox`. Ends with its standard input."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
from pathlib import Path
from typing import IO, Any

from hil.errors import RecordingError
from hil.recording.bounds import memory_bytes, processor_s
from hil.recording.formats import FORMATS, metadata_of, tables_of
from hil.recording.request import Request
from hil.recording.sandbox import described, send
from hil.recording.survey import survey_of


def main() -> None:
    """Answer one request a line: a file to read, its table or its metadata."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever asks, and ends this process by its input
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # libraries print
    for line in sys.stdin:
        _answer(answers, json.loads(line))


def _answer(answers: IO[bytes], request: dict[str, Any]) -> None:
    path = Path(request["path"])
    form = FORMATS[path.suffix.lower()]
    size = path.stat().st_size
    _limit(size)
    try:
        if request["what"] == "metadata":
            send(answers, {"metadata": dict(metadata_of(form, path))})
        elif request["what"] == "survey":
            asked = Request.of_document(request["request"])
            send(answers, {"survey": survey_of(tables_of(form, path, asked, every=True)).as_document()})
        else:
            table = tables_of(form, path, Request.of_document(request["request"]))[0]
            send(answers, described(table), table.columns)
    except RecordingError as error:
        send(answers, {"problems": list(error.problems)})
    except MemoryError:
        send(
            answers,
            {"problems": [f"expected a recording that is read in {memory_bytes(size) >> 20} MiB, got a larger"]},
        )
    except Exception as error:  # noqa: BLE001 - the libraries raise anything on a damaged file
        got = f"{type(error).__name__}: {error}"
        send(
            answers,
            {"problems": [f"expected a whole recording, got a damaged one ({got}). Take a copy that is whole."]},
        )


def _limit(file_bytes: int) -> None:
    """Bound memory and time of what follows, where the system can; whoever asks does not wait longer anyway."""
    try:
        import resource
    except ImportError:
        return
    _lower(resource.RLIMIT_CORE, 0)
    _lower(resource.RLIMIT_CPU, math.ceil(time.process_time() + processor_s(file_bytes)))
    _lower(resource.RLIMIT_AS, _address_space() + memory_bytes(file_bytes))


def _lower(which: int, limit: int) -> None:
    """Set what is allowed from now on, inside what the system allows at all."""
    import resource

    _, most = resource.getrlimit(which)
    resource.setrlimit(which, (limit if most == resource.RLIM_INFINITY else min(limit, most), most))


def _address_space() -> int:
    """Return what this process has of it, its libraries included [byte]; 0 where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (OSError, ValueError, IndexError):
        return 1 << 30
    return pages * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":
    main()
