"""Text recordings: written as plain CSV, one header line and one line per row; read in the forms that people write.

- What form a file has is recognised (`hil.recording.text_form`) or set by hand; pyarrow parses it.

- Floats are written as the shortest decimal that reads back to the same bits, integers without a point; that
  difference is how a reader distinguishes them, so that CSV to Parquet and back loses nothing. Units, metadata and the
  kind of columns whose cells do not tell it stand in a file next to it (`hil.recording.description`); without that
  file text that looks like a number becomes one, and an empty cell among numbers is NaN.
- A last line without line end is taken (RFC 4180 allows it): a file cut inside its very last number can't be
  distinguished from a whole one. A cut anywhere else leaves a row with cells missing, and is refused.
- A quoted cell must end on its line, so that a row is a line and every fault has its number.
- A byte order mark says how bytes are text, else what was set by hand does, else it is UTF-8.
"""

from __future__ import annotations

import codecs
import gzip
import re
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.csv

from drivers.foreign_file import read_regular
from hil.errors import RecordingError
from hil.recording.bounds import CELLS, damaged, require_columns
from hil.recording.channels import numbers_of_texts
from hil.recording.description import NO_SIDECAR, Sidecar, as_metadata, read_sidecar, write_sidecar
from hil.recording.request import FormatHints, Request
from hil.recording.table import Column, ColumnKind, Table, as_text, line_of
from hil.recording.text_form import BLANKS, MISSING, SAMPLE_LINES, TextForm, recognise, split

SPECIAL = ",;\t|"  # characters that a reader could take for a delimiter

OWN: Final[Mapping[str, object]] = {"delimiter": ",", "decimal": ".", "header_line": 1, "units_line": 0}
"""Form of a recording with a sidecar: as hil writes it, nothing has to be recognised."""

BLOCK_BYTES = 1 << 22  # pyarrow parses this much at once; also the longest line it can take
TRAILING = "\0"  # stands for what follows a delimiter that ends a row

LONG_FORM: Final = frozenset({"_time", "_field", "_value"})
"""Columns of a text of InfluxDB, with a row for each value of each series."""

UNPACKED_PER_BYTE: Final = 200  # text of numbers packs to a tenth: beyond, it was made to fill the memory

END_OF_HEADER: Final = "***End_of_Header***"

MARKS: Final = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # begins like that of UTF-16
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
"""Byte order marks (Unicode 15, 23.8) and the encoding that reads them."""

WITHOUT_MARK: Final = ((1, "utf-16-le"), (0, "utf-16-be"))
"""UTF-16 without a mark: of ASCII every second byte is NUL, from this one on."""

LOOKED_AT_BYTES: Final = 64  # enough for the names of a column or two

FALLBACK: Final = "latin-1"
"""What a file that is no UTF-8 most likely is: of a Windows program, whose other characters are in no unit."""


def as_column(cells: pa.ChunkedArray, kind: ColumnKind | None = None, decimal: str = ".") -> Column:
    """Turn text into the kind it is said to be; unsaid into int64, float64 or text, whichever first fits every cell.

    In a column with a number in it, a missing cell is NaN.
    """
    if kind is ColumnKind.TEXT:
        return as_text(cells.to_pylist())
    if kind is ColumnKind.BOOLEAN and pa.compute.all(pa.compute.is_in(cells, pa.array(["True", "False"]))).as_py():
        return np.asarray(pa.compute.equal(cells, "True").to_numpy())
    trimmed = pa.compute.utf8_trim_whitespace(cells)
    present = pa.compute.if_else(pa.compute.is_in(trimmed, pa.array(MISSING)), pa.scalar(None, pa.string()), trimmed)
    plain = without_groups(present, "," if decimal == "." else ".")
    if decimal == ",":
        swapped = pa.compute.replace_substring(plain, ".", "_")
        plain = pa.compute.replace_substring(swapped, ",", ".")
    for numeric in (pa.int64(), pa.float64()):
        try:
            numbers = pa.compute.cast(plain, numeric)
        except pa.ArrowInvalid:
            continue
        if numbers.null_count == len(numbers):
            break  # nothing but missing cells: an empty text is one, too
        return np.asarray((numbers.cast(pa.float64()) if numbers.null_count else numbers).to_numpy())
    return as_text(trimmed.to_pylist())


def without_groups(cells: pa.ChunkedArray, mark: str) -> pa.ChunkedArray:
    """Return cells with the digits of numbers such as 1,079.941 together, as spreadsheets and people group them.

    1,079 alone may be a decimal comma: it is a group only where another cell of the column shows that.
    """
    groups = rf"[+-]?[1-9]\d{{0,2}}([{mark}]\d{{3}})"
    if not pa.compute.any(
        pa.compute.match_substring_regex(cells, rf"^({groups}+[^{mark}\d]\d+|{groups}{{2,}})$")
    ).as_py():
        return cells
    grouped = pa.compute.match_substring_regex(cells, rf"^{groups}+([^{mark}\d]\d*)?$")
    return pa.compute.if_else(grouped, pa.compute.replace_substring(cells, mark, ""), cells)


def read(path: Path, request: Request) -> Table:
    """Read a text recording, in the form that it is recognised to have or that was set by hand."""
    said = read_sidecar(path)
    text, encoding = decoded(path, read_regular(path), request.form.encoding)
    if path.suffix.lower() == ".lvm":
        text = labview_text(text)
    return table_of_text(path, text, request.form, encoding, said)


def read_packed(path: Path, request: Request) -> Table:
    """Read a text recording that gzip packed, such as run.csv.gz."""
    if (inner := Path(path.stem).suffix.lower()) not in ("", ".csv", ".txt", ".tsv"):
        raise RecordingError(path, f"expected text in it, as in run.csv.gz, got {inner}: unpack it first (gunzip)")
    most = max(CELLS, UNPACKED_PER_BYTE * path.stat().st_size)
    try:
        with gzip.open(path) as file:
            content = file.read(most + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise damaged(path, "a whole file of gzip", error) from error
    if len(content) > most:
        raise RecordingError(path, f"expected at most {most} bytes of text in it, got more: it is no recording")
    text, encoding = decoded(path, content, request.form.encoding)
    return table_of_text(path, text, request.form, encoding)


def table_of_text(
    path: Path, text: str, hints: FormatHints, encoding: str = "utf-8", said: Sidecar = NO_SIDECAR, remark: str = ""
) -> Table:
    """Return the table that a text is."""
    if not text or text.isspace():
        return Table(path, {})  # refuses: nothing in it
    form = replace(form_of(text, hints.model_copy(update=OWN) if said.found else hints), encoding=encoding)
    form = _with_every_name(path, form)
    rows, skipped = _rows(path, text, form)
    del text
    if not rows:
        return Table(path, {})  # refuses: no rows
    cells = _parse(path, rows, form, skipped)
    del rows
    columns: dict[str, Column] = {}
    for name in form.names:
        columns[name] = as_column(cells[name], said.types.get(name), form.decimal)
        cells = cells.drop_columns([name])  # a cell as text takes several times what it does as a number
    pa.default_memory_pool().release_unused()
    table = Table(
        path,
        columns,
        dict(said.units if said.found else form.units),
        said.metadata,
        form.first_row_line,
        tuple(line for line in (remark, ", ".join(form.said())) if line),
        skipped,
        elsewhere={
            name: f"line {form.header_line}: column {name} comes twice or more, as {name} (1) and {name} (2): name "
            "the one that is meant in [signals]"
            for name in form.repeated
        },
    )
    return pivoted(table) if LONG_FORM <= columns.keys() else table


def pivoted(table: Table) -> Table:
    """Return a table with a column for each series of one that has a row for each value."""
    stamps, fields, values = (table.columns[name] for name in ("_time", "_field", "_value"))
    if ColumnKind.of(values) is ColumnKind.TEXT or ColumnKind.of(fields) is not ColumnKind.TEXT:
        return table
    times = np.unique(stamps)
    columns: dict[str, Column] = {"_time": times}
    for name in dict.fromkeys(fields.tolist()):
        of_it = fields == name
        columns[name] = np.full(times.size, np.nan)
        columns[name][np.searchsorted(times, stamps[of_it])] = values[of_it]
    return replace(table, columns=columns, first_line=None, skipped=(), remarks=(*table.remarks, "series by _field"))


def labview_text(text: str) -> str:
    """Return the last table of a LabVIEW measurement file, its units as a line behind the names."""
    head, _, body = text.rpartition(END_OF_HEADER)
    lines = body.lstrip("\t").lstrip("\r\n").split("\n")
    names = lines[0].rstrip("\r").split("\t")
    if names[-1] == "Comment":
        names.pop()
    units = next((line.split("\t")[1:] for line in head.split("\n") if line.startswith("Y_Unit_Label")), [])
    listed = ["s", *units, *[""] * len(names)][: len(names)]
    rows = [line.rstrip("\r\t") for line in lines[1:]]
    return "\n".join(["\t".join(names), "\t".join(listed), *rows])


def form_of(text: str, hints: FormatHints) -> TextForm:
    """Return the form of a text, by its first lines."""
    lines = text[:BLOCK_BYTES].split("\n", SAMPLE_LINES)[:SAMPLE_LINES]
    if len(text) > BLOCK_BYTES and 1 < len(lines) < SAMPLE_LINES:
        lines.pop()  # cut in the middle
    return recognise(lines, hints)


def write(table: Table, path: Path) -> None:
    """Write a table as CSV, and what it says of itself next to it."""
    columns = [_cells(table, path, name) for name in table.columns]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(map(_quoted, table.columns)) + "\n")
        file.writelines(",".join(row) + "\n" for row in zip(*columns, strict=True))
    write_sidecar(path, description_of(table), needed=not _is_recognised(path, table))


def _is_recognised(path: Path, table: Table) -> bool:
    """Whether the form of a file that hil wrote is recognised without a sidecar."""
    with path.open(encoding="utf-8", newline="\n") as file:
        text = file.read(BLOCK_BYTES)
    form = form_of(text.rstrip("\n"), FormatHints())
    plain = TextForm(tuple(table.columns))
    return form == plain


def description_of(table: Table) -> Sidecar:
    """Return what has to stand next to a table that is written as CSV."""
    types = {name: ColumnKind.of(column) for name, column in table.columns.items() if not _tells_its_kind(column)}
    return Sidecar(as_metadata(table.metadata), table.units, types)


def _with_every_name(path: Path, form: TextForm) -> TextForm:
    """Return a form whose columns all have names: the first is an index where it has none, as pandas writes it."""
    require_columns(path, form.width)
    names = ("index", *form.names[1:]) if form.names and not form.names[0] and len(form.names) > 1 else form.names
    problems = [
        f"line {form.header_line}: cell {number} of the header is empty, expected a column name"
        for number, name in enumerate(names or ("",), start=1)
        if not name
    ]
    if problems:
        raise RecordingError(path, *problems)
    return replace(form, names=names)


def _rows(path: Path, text: str, form: TextForm) -> tuple[bytes, tuple[int, ...]]:
    """Return the lines that are rows, and the numbers of the lines among them that are none."""
    start = 0
    for _ in range(form.first_row_line - 1):
        start = text.find("\n", start) + 1
        if start == 0:
            return b"", ()
    body = text[start:]
    skipped: list[int] = []
    if form.comment and f"\n{form.comment}" in f"\n{body}":
        lines = body.split("\n")
        skipped = [k + form.first_row_line for k, line in enumerate(lines) if line.startswith(form.comment)]
        body = "\n".join(line for line in lines if not line.startswith(form.comment)).rstrip("\n")
    if "\n\n" in body and len(form.names) > 1:
        line = body.count("\n", 0, body.index("\n\n")) + 1 + form.first_row_line
        line += sum(number <= line for number in skipped)
        raise RecordingError(
            path, f"line {line}: expected a row, got an empty line. Remove it; a missing sample is nan."
        )
    if form.delimiter == BLANKS:
        body = re.sub(r"[ \t]+", " ", re.sub(r"(?m)^[ \t]+|[ \t]+$", "", body))
    return body.encode("utf-8"), tuple(skipped)


def _parse(path: Path, rows: bytes, form: TextForm, skipped: tuple[int, ...]) -> pa.Table:
    """Cut the rows into cells, all as text."""
    names = [*form.names, *([TRAILING] if form.trailing else [])]
    try:
        cells = pa.csv.read_csv(
            pa.BufferReader(_outside_python(rows)),
            pa.csv.ReadOptions(column_names=names, block_size=BLOCK_BYTES),
            pa.csv.ParseOptions(delimiter=form.delimiter, newlines_in_values=False, ignore_empty_lines=False),
            pa.csv.ConvertOptions(
                column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False, check_utf8=False
            ),
        )
    except pa.ArrowInvalid as error:
        raise RecordingError(path, _broken_line(rows, form, skipped)) from error
    if cells.num_rows != rows.count(b"\n") + 1:
        raise RecordingError(path, _broken_line(rows, form, skipped))
    return cells


def _outside_python(rows: bytes) -> pa.Buffer:
    """Copy rows to memory of pyarrow's: its threads may free them last, at exit, when Python is no longer there."""
    buffer = pa.allocate_buffer(len(rows))
    np.frombuffer(buffer, dtype=np.uint8)[:] = np.frombuffer(rows, dtype=np.uint8)
    return buffer


def _broken_line(rows: bytes, form: TextForm, skipped: tuple[int, ...]) -> str:
    """Find the first line that is no row of the header's number of cells, and say what is wrong with it."""
    lines = rows.decode("utf-8").split("\n")
    for row, line in enumerate(lines):
        number = line_of(row, form.first_row_line, skipped)
        if line.count('"') % 2:
            return f"line {number}: expected every quoted cell to end on its line, got one that does not"
        count = len(split(line, form.delimiter) or [""])
        if count != form.width:
            cut = row + 1 == len(lines) and count < form.width
            cure = "the file is truncated: remove its last line or record again" if cut else "fix that line"
            if form.delimiter == "," and form.width < count <= 2 * form.width and row == 0 and _are_digits(line):
                cure = "its numbers have decimal commas: save it with ; between cells, or with decimal points"
            where = "as in the header" if form.header_line else "as in most lines"
            return f"line {number}: expected {form.width} cells {where}, got {count}; {cure}"
    return f"expected lines shorter than {BLOCK_BYTES} bytes, got a longer one"


def _are_digits(line: str) -> bool:
    """Tell whether a line between commas is digits alone, as numbers with decimal commas are."""
    return all(cell.strip().lstrip("+-").isdigit() for cell in line.split(","))


def _tells_its_kind(column: Column) -> bool:
    """Whether the cells alone lead a reader to the same column."""
    if ColumnKind.of(column) is not ColumnKind.TEXT:
        return ColumnKind.of(column) is not ColumnKind.BOOLEAN
    read = as_column(pa.chunked_array([pa.array(column, type=pa.string())]))
    if ColumnKind.of(read) is ColumnKind.TEXT and numbers_of_texts(read) is not None:
        return False
    return ColumnKind.of(read) is ColumnKind.TEXT and bool(np.all(read == column))


def _cells(table: Table, path: Path, name: str) -> Iterable[str]:
    column = table.columns[name]
    if column.dtype != object:
        return map(repr, column.tolist())
    texts = column.tolist()
    broken = next((row for row, text in enumerate(texts) if "\n" in text or "\r" in text), None)
    if broken is not None:
        raise RecordingError(
            path,
            f"column {name}, row {broken + 1}: expected a text of one line, got one with a line break. "
            "CSV can't hold it: write Parquet.",
        )
    return map(_quoted, texts)


def _quoted(text: str) -> str:
    """Quote a text with anything in it that a reader could take for a delimiter, or that would leave a line blank."""
    unclear = not text.strip() or any(c in text for c in f'{SPECIAL}"')
    return '"' + text.replace('"', '""') + '"' if unclear else text


def encoding_of(content: bytes, given: str) -> str:
    """Return how a file is encoded, as far as it tells, else ``given``."""
    for mark, name in MARKS:
        if content.startswith(mark):
            return name
    start = content[:LOOKED_AT_BYTES]
    start = start[: len(start) // 2 * 2]
    for first, name in WITHOUT_MARK:
        if len(start) >= 4 and not any(start[first::2]) and all(start[1 - first :: 2]):
            return name
    return given


def decoded(path: Path, content: bytes, given: str) -> tuple[str, str]:
    """Return a file's text with line feeds only and no empty lines at the end, and its encoding."""
    encoding = encoding_of(content, given)
    try:
        text = content.decode(encoding)
    except UnicodeError as error:
        start = error.start if isinstance(error, UnicodeDecodeError) else 0
        line = content.count(b"\n", 0, start) + 1
        byte = content[start : start + 1].hex()
        raise RecordingError(
            path,
            f"line {line}: expected {encoding} text, got byte 0x{byte}. Give its encoding in the model file: "
            f'[signals] format = {{ encoding = "{FALLBACK}" }}.',
        ) from error
    lines = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    return lines.rstrip("\n"), encoding


def likely_encoding(content: bytes) -> str:
    """Return the encoding to try: what the file tells, else UTF-8 where it is some, else `FALLBACK`."""
    encoding = encoding_of(content, "utf-8")
    try:
        content.decode(encoding)
    except UnicodeError:
        return FALLBACK
    return encoding
