"""The process that reads recordings for another one; see `hil.recording.sandbox`. Ends with its standard input."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hil.errors import RecordingError
from hil.recording.bounds import memory_bytes, processor_s
from hil.recording.formats import FORMATS, metadata_of, tables_of
from hil.recording.request import Request
from hil.recording.sandbox import Document, described, limit, serve
from hil.recording.survey import survey_of
from hil.recording.table import Column


def answer(request: Document, _: Mapping[str, Column]) -> tuple[Document, Mapping[str, Column] | None]:
    """Read a file: its table, its metadata or a survey of it."""
    path = Path(request["path"])
    form = FORMATS[path.suffix.lower()]
    size = path.stat().st_size
    limit(memory_bytes(size), processor_s(size))
    asked = Request.of_document(request["request"])
    try:
        if request["what"] == "metadata":
            return {"metadata": dict(metadata_of(form, path))}, None
        if request["what"] == "survey":
            return {"survey": survey_of(tables_of(form, path, asked, every=True)).as_document()}, None
        table = tables_of(form, path, asked)[0]
        return described(table), table.columns
    except RecordingError as error:
        return {"problems": list(error.problems)}, None
    except MemoryError:
        problem = f"expected a recording that is read in {memory_bytes(size) >> 20} MiB, got a larger"
        return {"problems": [problem]}, None
    except Exception as error:  # noqa: BLE001 - the libraries raise anything on a damaged file
        got = f"{type(error).__name__}: {error}"
        problem = f"expected a whole recording, got a damaged one ({got}). Take a copy that is whole."
        return {"problems": [problem]}, None


if __name__ == "__main__":
    serve(answer)
