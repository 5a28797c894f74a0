"""A store may be someone else's, or damaged inside a row: no row leads out of its folder, and none hides the others."""

from __future__ import annotations

import sqlite3
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hil.cli.main import run
from hil.errors import StoreError
from hil.store import RunStore, register_run, store_of
from hil.store.rebuild import rebuild

Record = Callable[..., Path]


@pytest.fixture
def filled(tmp_path: Path, record: Record) -> Path:
    """A folder in another one, with the runs 1 and 2, of which 1 is noted."""
    (tmp_path / "thesis.csv").write_text("precious")
    for name in ("store/a.csv", "store/b.csv"):
        register_run(record(name))
    with RunStore(tmp_path / "store") as store:
        store.note(1, "windy")
        store.attach(1, "../../up", "text")
    return tmp_path / "store"


def change(folder: Path, statement: str, *values: Any) -> None:
    with sqlite3.connect(store_of(folder)) as database:
        database.execute(statement, values)
    database.close()


@pytest.mark.parametrize(
    "name", ["{outside}", "../thesis.csv", "x/../../thesis.csv", "link.csv", ".", "", "x\0y", "x" * 400]
)
def test_a_row_that_leads_out_of_the_folder_is_reported_and_harms_nothing(
    filled: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    outside = filled.parent / "thesis.csv"
    (filled / "link.csv").symlink_to(outside)
    change(filled, "UPDATE runs SET recording = ? WHERE id = 1", name.format(outside=outside))
    assert run(["runs", "--store", str(filled)]) == 0
    said = capsys.readouterr().out
    assert "damaged in" in said
    assert "b.csv" in said
    run(["runs", "delete", "1", "--yes", "--with-recording", "--store", str(filled)])
    assert run(["runs", "export", "--store", str(filled), "--out", str(filled / "all.zip")]) == 0
    with zipfile.ZipFile(filled / "all.zip") as archive:
        assert not any("thesis" in entry or ".." in entry.split("/") for entry in archive.namelist())
    assert outside.read_text() == "precious"


def test_what_is_not_the_recording_of_the_run_is_not_deleted(filled: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, content in (("mine.csv", "time_s,x\n0,1\n1,2\n"), ("mine.txt", "mine")):
        (filled / name).write_text(content)
        change(filled, "UPDATE runs SET recording = ? WHERE id = 1", name)
        assert run(["runs", "delete", "1", "--yes", "--with-recording", "--store", str(filled)]) == 2
        assert "delete" in capsys.readouterr().err
        assert (filled / name).read_text() == content
    with RunStore(filled) as store:
        assert len(store.find()) == 2


def test_only_what_was_made_with_a_recording_goes_with_it(filled: Path) -> None:
    (filled / "a.online.json").write_text("mine")
    assert run(["runs", "delete", "1", "--yes", "--with-recording", "--store", str(filled)]) == 0
    assert not (filled / "a.csv").exists()
    assert not (filled / "a.csv.json").exists()
    assert (filled / "a.online.json").read_text() == "mine"


WRONG = {
    "settings": ['{"pace": "fa', "[]", "[" * 3000, '{"pace": 1}', 3, "\\"],
    "experiment": [b"\xff\xfe"],
    "started_utc": [b"2026"],
    "duration_s": ["long", float("inf"), b""],
    "samples": ["many", -1],
    "outcome": [b"\x00"],
}


@pytest.mark.parametrize(("column", "value"), [(name, value) for name, values in WRONG.items() for value in values])
def test_a_damaged_row_hides_no_other_and_is_read_again_from_its_recording(
    filled: Path, column: str, value: object, capsys: pytest.CaptureFixture[str]
) -> None:
    change(filled, f"UPDATE runs SET {column} = ? WHERE id = 1", value)
    for line in (["runs"], ["runs", "--json"], ["runs", "show", "1"], ["runs", "compare", "1", "2"]):
        assert run([*line, "--store", str(filled)]) == 0
    assert f"damaged in the store ({column})" in capsys.readouterr().out
    rebuild(filled)
    with RunStore(filled) as store:
        runs = store.find()
    assert [(each.run_id, each.entry.recording.name, each.entry.outcome) for each in runs] == [
        (1, "a.csv", "complete"),
        (2, "b.csv", "complete"),
    ]
    assert [note.text for note in runs[0].notes] == ["windy"]


def test_text_that_is_no_utf_8_is_shown_as_far_as_it_goes(filled: Path) -> None:
    change(filled, "UPDATE notes SET text = CAST(x'77ff79' AS TEXT)")
    with RunStore(filled) as store:
        assert store.get(1).notes[0].text == "w\ufffdy"


@pytest.mark.parametrize("column", ["experiment", "settings"])
def test_a_store_whose_tables_are_others_is_damaged_and_rebuilt(filled: Path, column: str) -> None:
    change(filled, f"ALTER TABLE runs RENAME COLUMN {column} TO wrong")
    with pytest.raises(StoreError, match=f"table runs has no column {column}"):
        RunStore(filled).__enter__()
    rebuild(filled)
    with RunStore(filled) as store:
        assert {each.entry.recording.name for each in store.find()} == {"a.csv", "b.csv"}
