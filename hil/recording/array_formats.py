"""Files of NumPy and of spreadsheets: .npz, .npy, .xlsx, .ods. No pickled object in them is run, and no formula."""

from __future__ import annotations

import csv
import io
import zipfile
from datetime import date, datetime, time
from pathlib import Path
from typing import Any, Final
from xml.etree.ElementTree import Element, iterparse

import numpy as np

from drivers.foreign_file import open_regular
from hil.errors import RecordingError
from hil.recording.bounds import COLUMNS, damaged, require_cells
from hil.recording.channels import column_of
from hil.recording.csv_format import table_of_text
from hil.recording.measurement_formats import library
from hil.recording.request import Request, under_names, vectors_of
from hil.recording.table import Table, columns_of_shared_length, is_column

MOMENTS: Final = "mM"

TABLE, OFFICE, TEXT = (f"{{urn:oasis:names:tc:opendocument:xmlns:{each}:1.0}}" for each in ("table", "office", "text"))


def read_numpy(path: Path, request: Request) -> Table:
    """Read arrays: vectors by their names, columns of matrices by address, fields of structured arrays."""
    try:
        with open_regular(path) as file:
            loaded: Any = np.load(file, allow_pickle=False)
            arrays = {path.stem: loaded} if isinstance(loaded, np.ndarray) else dict(loaded)
    except Exception as error:  # zipfile and NumPy raise anything on a damaged file
        raise damaged(path, "arrays of numbers, as numpy.save and numpy.savez write them", error) from error
    require_cells(path, sum(array.size for array in arrays.values()))
    fields = {
        name if len(arrays) == 1 else f"{key}.{name}": array[name]
        for key, array in arrays.items()
        for name in array.dtype.names or ()
    }
    plain = {key: array for key, array in arrays.items() if array.dtype.names is None}
    vectors = {
        name: column_of(values)
        for key, array in {**fields, **plain}.items()
        for name, values in (vectors_of(key, array) if array.dtype.kind not in MOMENTS else [(key, array.ravel())])
        if values.dtype.kind in MOMENTS or is_column(values)
    }
    chosen, left_out = columns_of_shared_length(under_names(vectors, request.names), request.names)
    return Table(path, chosen, remarks=left_out)


def read_xlsx(path: Path, request: Request) -> Table:
    """Read the sheet with the most rows of a workbook, as if it had been saved as CSV."""
    openpyxl = library(path, "openpyxl", "openpyxl")
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: _text_of(path, sheet) for sheet in book.worksheets}
        book.close()
    except RecordingError:
        raise
    except Exception as error:  # the library raises anything on a damaged file
        raise damaged(path, "a whole workbook", error) from error
    name, text = max(sheets.items(), key=lambda sheet: sheet[1].count("\n"))
    hints = request.form.model_copy(update={"delimiter": ",", "decimal": "."})
    return table_of_text(path, text, hints, remark=f"sheet {name}" if len(sheets) > 1 else "")


def _text_of(path: Path, sheet: Any) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    cells = 0
    for row in sheet.iter_rows(values_only=True):
        cells += len(row)
        require_cells(path, cells)
        if any(cell is not None for cell in row):
            writer.writerow([_cell(cell) for cell in row])
    return text.getvalue().rstrip("\n")


def _cell(cell: object) -> str:
    if isinstance(cell, datetime | date | time):
        return str(cell)
    return "" if cell is None else repr(cell) if isinstance(cell, float) else str(cell)


def read_ods(path: Path, request: Request) -> Table:
    """Read the sheet with the most rows of an OpenDocument workbook, as if it had been saved as CSV."""
    sheets: dict[str, list[str]] = {}
    try:
        with zipfile.ZipFile(path) as book, book.open("content.xml") as content:
            for _, sheet in iterparse(content):
                if sheet.tag == f"{TABLE}table":
                    sheets[sheet.get(f"{TABLE}name", "")] = _ods_lines(path, sheet)
                    sheet.clear()
    except RecordingError:
        raise
    except Exception as error:  # zipfile and the parser raise anything on a damaged file
        raise damaged(path, "a whole OpenDocument workbook", error) from error
    name, lines = max(sheets.items(), key=lambda sheet: len(sheet[1]), default=("", []))
    hints = request.form.model_copy(update={"delimiter": ",", "decimal": "."})
    return table_of_text(path, "\n".join(lines), hints, remark=f"sheet {name}" if len(sheets) > 1 else "")


def _ods_lines(path: Path, sheet: Element) -> list[str]:
    """Return the rows of a sheet that are not empty; cells and rows that are alike are stored once, and counted."""
    lines: list[str] = []
    count = 0
    for row in sheet.iter(f"{TABLE}table-row"):
        cells: list[str] = []
        for cell in row:
            value = _ods_cell(cell)
            times = int(cell.get(f"{TABLE}number-columns-repeated", "1"))
            cells += [value] * (times if value else min(times, COLUMNS))
        while cells and not cells[-1]:
            cells.pop()
        if not cells:
            continue
        times = int(row.get(f"{TABLE}number-rows-repeated", "1"))
        count += times * len(cells)
        require_cells(path, count)
        text = io.StringIO()
        csv.writer(text, lineterminator="").writerow(cells)
        lines += [text.getvalue()] * times
    return lines


def _ods_cell(cell: Element) -> str:
    """Return a number as it is stored, and all else as it is shown."""
    stored = cell.get(f"{OFFICE}value") or cell.get(f"{OFFICE}date-value")
    return stored or "\n".join("".join(part.itertext()) for part in cell.iter(f"{TEXT}p"))
