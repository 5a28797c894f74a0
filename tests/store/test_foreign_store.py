"""A list of runs may be damaged or someone else's: no file of it leads out of its folder, none hides the others."""

import json
import sqlite3
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hil.cli.main import run
from hil.errors import StoreError
from hil.store import RunStore, register_run, store_of
from hil.store.rebuild import rebuild
from tests.chosen import one_in
from tests.full_disk import largest_file

Record = Callable[..., Path]
Capture = pytest.CaptureFixture[str]


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


def change(folder: Path, key: str, value: object) -> None:
    """Change what the list says of run 1."""
    path = store_of(folder) / "1.json"
    document = json.loads(path.read_text())
    document["run"][key] = value
    path.write_text(json.dumps(document))


@pytest.mark.parametrize(
    "name", one_in(3, ["{outside}", "../thesis.csv", "x/../../thesis.csv", "link.csv", ".", "", "x\0y", "x" * 400])
)
def test_a_run_that_leads_out_of_the_folder_is_reported_and_harms_nothing(
    filled: Path, name: str, capsys: Capture
) -> None:
    outside = filled.parent / "thesis.csv"
    (filled / "link.csv").symlink_to(outside)
    change(filled, "recording", name.format(outside=outside))
    assert run(["runs", "--store", str(filled)]) == 0
    said = capsys.readouterr().out
    assert "damaged in" in said
    assert "b.csv" in said
    run(["runs", "delete", "1", "--yes", "--with-recording", "--store", str(filled)])
    assert run(["runs", "export", "--store", str(filled), "--out", str(filled / "all.zip")]) == 0
    with zipfile.ZipFile(filled / "all.zip") as archive:
        assert not any("thesis" in entry or ".." in entry.split("/") for entry in archive.namelist())
    assert outside.read_text() == "precious"


def test_what_is_not_the_recording_of_the_run_is_not_deleted(filled: Path, capsys: Capture) -> None:
    for name, content in (("mine.csv", "time_s,x\n0,1\n1,2\n"), ("mine.txt", "mine")):
        (filled / name).write_text(content)
        change(filled, "recording", name)
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


WRONG: dict[str, list[Any]] = {
    "settings": ["text", [], {"pace": 1}, 3],
    "experiment": [3, None, {}],
    "duration_s": ["long", "inf"],
    "samples": ["many", -1],
    "outcome": [[]],
}


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in WRONG.items() for value in values])
def test_a_damaged_run_hides_no_other_and_its_recording_is_entered_anew(
    filled: Path, key: str, value: object, capsys: Capture
) -> None:
    change(filled, key, value)
    for line in (["runs"], ["runs", "--json"], ["runs", "show", "1"], ["runs", "compare", "1", "2"]):
        assert run([*line, "--store", str(filled)]) == 0
    assert f"damaged in the list of runs ({key}" in capsys.readouterr().out
    assert run(["runs", "delete", "1", "--yes", "--store", str(filled)]) == 0
    assert rebuild(filled).found == 1
    with RunStore(filled) as store:
        runs = store.find()
    assert [(each.run_id, each.entry.recording.name, each.entry.outcome) for each in runs] == [
        (2, "b.csv", "complete"),
        (3, "a.csv", "complete"),
    ]


GARBAGE = [b"", b"{", b"[]", b"\xff\xfe", b"[" * 100_000, b'{"schema": "hil.run_card/1", "run": 3}', b'{"schema": 1}']


@pytest.mark.parametrize("name", one_in(3, ["1.json", "1.note_1.json", "1.result_1.json", "1.result_1.document"]))
def test_a_file_of_the_list_that_is_something_else_is_shown_as_damaged(
    filled: Path, name: str, capsys: Capture
) -> None:
    for content in GARBAGE:
        (store_of(filled) / name).write_bytes(content)
        for line in (["runs"], ["runs", "show", "1"], ["runs", "--text", "x"]):
            assert run([*line, "--store", str(filled)]) == 0
        assert ("damaged" in capsys.readouterr().out) == name.endswith("json")
    rebuild(filled)
    with RunStore(filled) as store:
        assert "a.csv" in {each.entry.recording.name for each in store.find()}


def test_the_database_of_a_stranger_runs_nothing_and_is_left_alone(filled: Path, capsys: Capture) -> None:
    """Lists were once databases; a trigger or a view in one could delete runs, or never end."""
    old = filled / "runs.sqlite"
    endless = "WITH RECURSIVE t(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM t) SELECT x FROM t"
    with sqlite3.connect(old) as database:
        database.executescript(f"CREATE TABLE mine (id); CREATE VIEW runs AS {endless};")
    database.close()
    before = old.read_bytes()
    for line in (["runs"], ["runs", "rebuild"], ["runs", "delete", "1", "--yes"]):
        assert run([*line, "--store", str(filled)]) == 0
    assert old.read_bytes() == before
    store_of(filled).rename(filled / "elsewhere")
    assert run(["runs", "--store", str(filled)]) == 2
    assert "runs.sqlite of an earlier version is not read" in capsys.readouterr().err


def test_a_full_disk_costs_only_what_was_being_entered(filled: Path) -> None:
    with RunStore(filled) as store, pytest.raises(StoreError, match=r"has room.*make room"), largest_file(4096):
        store.attach(2, "model", "x" * 400_000)
    with RunStore(filled) as store:
        assert [len(each.attachments) for each in store.find()] == [1, 0]
    assert not list(store_of(filled).glob(".*"))


WRITER = """
import sys
from pathlib import Path
from hil.store import RunStore
folder, who, count = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
with RunStore(folder) as store:
    for k in range(count):
        store.note(1, f"{who} {k}")
        print(k, flush=True)
"""


def test_two_processes_write_at_once_and_nothing_is_lost(filled: Path) -> None:
    count = 20
    writers = [subprocess.Popen([sys.executable, "-c", WRITER, str(filled), who, str(count)]) for who in ("x", "y")]
    assert [writer.wait(60) for writer in writers] == [0, 0]
    with RunStore(filled) as store:
        texts = [note.text for note in store.get(1).notes]
    for who in ("x", "y"):
        assert [text for text in texts if text.startswith(who)] == [f"{who} {k}" for k in range(count)]


def test_a_listing_reads_the_small_files_alone(tmp_path: Path, record: Record) -> None:
    """As 10,000 runs are listed in some seconds, 500 are in half of one."""
    register_run(record("a.csv"))
    card = (store_of(tmp_path) / "1.json").read_text()
    for number in range(2, 501):
        (store_of(tmp_path) / f"{number}.json").write_text(card.replace("a.csv", f"{number}.csv"))
    began = time.process_time()
    with RunStore(tmp_path) as store:
        assert len(store.find()) == 500
    assert time.process_time() - began < 0.5
