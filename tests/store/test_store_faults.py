"""A damaged, full, foreign, newer, locked or killed store: a clear statement, and nothing committed is lost."""

from __future__ import annotations

import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from hil.errors import StoreError
from hil.store import RunStore, connection, register_run, schema, store_of
from hil.store.rebuild import rebuild
from hil.store.schema import MIGRATIONS
from tests.full_disk import largest_file

Record = Callable[..., Path]

PAGE_BYTES = 4096


@pytest.fixture
def filled(tmp_path: Path, record: Record) -> Path:
    """Three runs, each with a note and a diagnosis."""
    for name in "abc":
        number = register_run(record(f"{name}.csv"))
        with RunStore(tmp_path) as store:
            store.note(number, f"note {name}")
            store.attach(number, "diagnosis", {"verdict": "explained", "long": "x" * 3 * PAGE_BYTES})
    return tmp_path


def names(folder: Path) -> dict[str, list[str]]:
    with RunStore(folder) as store:
        return {run.entry.recording.stem: [note.text for note in run.notes] for run in store.find()}


@pytest.mark.parametrize("content", [b"", b"no database at all" * 300, b"SQLite format 3\0" + bytes(5000)])
def test_what_is_no_store_at_all(tmp_path: Path, record: Record, content: bytes) -> None:
    """An empty file is an empty database to SQLite: there is nothing in it to lose."""
    record("a.csv")
    store_of(tmp_path).write_bytes(content)
    if content:
        with pytest.raises(StoreError, match=r"expected a whole store of runs, got a damaged one.*hil runs rebuild"):
            RunStore(tmp_path).__enter__()
    result = rebuild(tmp_path)
    assert (result.before, result.found) == (0, 1)
    assert (result.damaged is not None) == bool(content)
    assert result.damaged is None or result.damaged.read_bytes() == content


def test_any_damaged_page_costs_no_run_and_only_notes_of_its_own(filled: Path) -> None:
    """Every page in turn; a note or verdict may go with its page, a run comes back from its recording."""
    store = store_of(filled)
    whole = store.read_bytes()
    costly = 0
    for page in range(len(whole) // PAGE_BYTES):
        start = page * PAGE_BYTES
        store.write_bytes(whole[:start] + b"\xa5" * PAGE_BYTES + whole[start + PAGE_BYTES :])
        with pytest.raises(StoreError, match=r"runs\.sqlite: .*damaged"):
            RunStore(filled).__enter__()
        rebuild(filled)
        found = names(filled)
        assert set(found) == set("abc")
        assert found in ({name: [f"note {name}"] for name in "abc"}, {name: [] for name in "abc"})
        costly += not any(found.values())
        for leftover in filled.glob("runs.sqlite*"):
            leftover.unlink()
    assert costly == 2  # the first page, which names all others, and that of the notes


def test_a_truncated_store_is_reported_and_rebuilt(filled: Path) -> None:
    store = store_of(filled)
    store.write_bytes(store.read_bytes()[: 5 * PAGE_BYTES])
    with pytest.raises(StoreError, match="damaged"):
        names(filled)
    rebuild(filled)
    assert set(names(filled)) == set("abc")


@pytest.mark.parametrize("version", [len(MIGRATIONS) + 1, -1])
def test_a_newer_store_is_refused_and_left_alone(filled: Path, version: int) -> None:
    with sqlite3.connect(store_of(filled)) as database:
        database.execute(f"PRAGMA user_version = {version}")
    database.close()
    before = store_of(filled).read_bytes()
    for attempt in (lambda: names(filled), lambda: rebuild(filled)):
        with pytest.raises(StoreError, match=f"version {len(MIGRATIONS)} or older, got version {version}"):
            attempt()
    assert store_of(filled).read_bytes() == before


def test_another_programs_database_is_refused_and_left_alone(tmp_path: Path) -> None:
    with sqlite3.connect(store_of(tmp_path)) as database:
        database.execute("CREATE TABLE theirs (x)")
    database.close()
    before = store_of(tmp_path).read_bytes()
    with pytest.raises(StoreError, match="another program's database"):
        names(tmp_path)
    assert store_of(tmp_path).read_bytes()[:16] == before[:16]
    with sqlite3.connect(store_of(tmp_path)) as database:
        assert database.execute("SELECT count(*) FROM theirs").fetchone() == (0,)
    database.close()


def test_an_older_store_is_brought_up_to_date(filled: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    more = (*MIGRATIONS, "ALTER TABLE runs ADD COLUMN operator TEXT;\nCREATE TABLE more (x);")
    monkeypatch.setattr(schema, "MIGRATIONS", more)
    assert set(names(filled)) == set("abc")
    with sqlite3.connect(store_of(filled)) as database:
        assert database.execute("PRAGMA user_version").fetchone() == (len(more),)
        assert database.execute("SELECT operator FROM runs LIMIT 1").fetchone() == (None,)
    database.close()


def test_a_step_that_fails_half_way_leaves_the_store_as_it_was(filled: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schema, "MIGRATIONS", (*MIGRATIONS, "CREATE TABLE half (x);\nCREATE TABLE runs (x);"))
    with pytest.raises(StoreError):
        names(filled)
    monkeypatch.undo()
    assert set(names(filled)) == set("abc")
    with sqlite3.connect(store_of(filled)) as database:
        assert database.execute("SELECT count(*) FROM sqlite_master WHERE name = 'half'").fetchone() == (0,)
    database.close()


def test_a_full_disk_costs_only_what_was_being_entered(filled: Path) -> None:
    with RunStore(filled) as store, pytest.raises(StoreError, match=r"expected room for the entry.*make room"):
        with largest_file(8 * PAGE_BYTES):
            store.attach(1, "model", "x" * 100 * PAGE_BYTES)
    assert names(filled) == {"a": ["note a"], "b": ["note b"], "c": ["note c"]}
    with RunStore(filled) as store:
        assert [attachment.kind for attachment in store.get(1).attachments] == ["diagnosis"]


@pytest.mark.parametrize("pages", [0, 4, 8, 12])
def test_a_full_disk_leaves_no_room_for_a_new_store_and_is_reported(tmp_path: Path, pages: int) -> None:
    """From 8 pages on there is room for the index of the WAL, and SQLite rolls back by itself."""
    with largest_file(pages * PAGE_BYTES), pytest.raises(StoreError, match=r"expected room for the entry.*make room"):
        names(tmp_path)
    assert names(tmp_path) == {}


def test_a_store_held_by_another_program_is_reported(filled: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "BUSY_S", 0.05)
    other = sqlite3.connect(store_of(filled), isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with RunStore(filled) as store:
        assert len(store.find()) == 3  # reading waits for nobody
        with pytest.raises(StoreError, match=r"within 0\.05 s.*Another program holds it"):
            store.note(1, "late")
        other.execute("ROLLBACK")
        store.note(1, "in time")
    other.close()


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
    count = 40
    writers = [subprocess.Popen([sys.executable, "-c", WRITER, str(filled), who, str(count)]) for who in ("x", "y")]
    assert [writer.wait(60) for writer in writers] == [0, 0]
    with RunStore(filled) as store:
        texts = [note.text for note in store.get(1).notes]
    for who in ("x", "y"):
        assert [text for text in texts if text.startswith(who)] == [f"{who} {k}" for k in range(count)]


def test_a_killed_writer_loses_nothing_it_had_committed(filled: Path) -> None:
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(filled), "x", "100000"], stdout=subprocess.PIPE, text=True
    )
    assert writer.stdout is not None
    for _ in range(30):
        writer.stdout.readline()
    writer.kill()
    said = 30 + len(writer.stdout.read().splitlines())
    writer.wait()
    writer.stdout.close()
    with RunStore(filled) as store:
        kept = [note.text for note in store.get(1).notes[1:]]
    assert kept[:said] == [f"x {k}" for k in range(said)]
    assert len(kept) - said in (0, 1)  # one may have been committed and not reported any more


def test_a_folder_that_can_not_be_written_is_reported(filled: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.rmtree(filled / "gone", ignore_errors=True)
    (filled / "gone").mkdir()
    (filled / "gone" / "runs.sqlite").mkdir()
    with pytest.raises(StoreError, match="expected a folder and a file that can be written"):
        names(filled / "gone")
