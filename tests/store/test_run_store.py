"""What goes into the store comes out of it; what can't be is refused, and nothing is half there."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from hil.errors import UsageError
from hil.recording.checksum import text_sha256
from hil.recording.formats import read_metadata
from hil.store import RunEntry, RunFilter, RunStore, register_run

Record = Callable[..., Path]


def test_a_registered_run_is_what_its_recording_says(tmp_path: Path, record: Record) -> None:
    path = record("a.parquet")
    number = register_run(path, "stopped by the operator")
    with RunStore(tmp_path) as store:
        run = store.get(number)
    entry = run.entry
    assert (entry.experiment, entry.started_utc, entry.software_version) == (
        "cruise",
        "2026-11-21T10:00:00+00:00",
        "0.1.0",
    )
    assert (entry.samples, entry.flagged, entry.outcome) == (50, 3, "stopped by the operator")
    assert entry.duration_s == pytest.approx(0.5)  # 50 periods of 10 ms
    assert (entry.rig_name, entry.rig_sha256) == ("bench", text_sha256(entry.rig_text))
    assert entry.data_sha256 == read_metadata(path)["data_sha256"]
    assert dict(entry.eds_sha256) == {"m1": "ab" * 32}
    assert dict(entry.settings) == {"pace": "fast"}
    assert entry.recording.resolve() == path.resolve()
    assert (run.verdict, run.notes, run.attachments) == ("", (), ())


def test_notes_and_results_are_kept_in_order(tmp_path: Path, record: Record) -> None:
    number = register_run(record("a.csv"))
    result = tmp_path / "diagnosis.json"
    result.write_text('{"verdict": "explained"}', encoding="utf-8")
    with RunStore(tmp_path) as store:
        store.note(number, "wind")
        store.note(number, "rain")
        store.attach(number, "diagnosis", {"verdict": "unexplained"})
        store.attach(number, "diagnosis", result)
        store.attach(number, "model", "J_M = 1.6")
        run = store.get(number)
        listed = store.find()[0]
    assert [note.text for note in run.notes] == ["wind", "rain"]
    assert run.verdict == listed.verdict == "explained"
    assert [attachment.kind for attachment in run.attachments] == ["diagnosis", "diagnosis", "model"]
    assert run.attachments[1].path == tmp_path / "diagnosis.json"
    assert run.attachments[0].as_json() == {"verdict": "unexplained"}
    assert run.attachments[2].as_json() is None
    assert [attachment.document for attachment in listed.attachments] == ["", "", ""]


@pytest.fixture
def four(tmp_path: Path, record: Record) -> Path:
    """Four runs of two experiments, two rigs and three days."""
    other = 'schema = "hil.rig/1"\nname = "bus 17"\n'
    numbers = [
        register_run(record("a.csv", "cruise", "2026-11-19T08:00:00+00:00")),
        register_run(record("b.csv", "tip", "2026-11-20T08:00:00+00:00")),
        register_run(record("c.csv", "cruise", "2026-11-20T23:59:59+00:00", other), "lost permissive"),
        register_run(record("d.csv", "cruise", "2026-11-21T08:00:00+00:00", other)),
    ]
    with RunStore(tmp_path) as store:
        store.note(numbers[1], "Wind from the LEFT")
        store.attach(numbers[0], "diagnosis", {"verdict": "unexplained"})
        store.attach(numbers[0], "diagnosis", {"verdict": "explained", "statement": "backlash"})
        store.attach(numbers[3], "diagnosis", {"verdict": "no_mismatch"})
    return tmp_path


@pytest.mark.parametrize(
    ("wanted", "names"),
    [
        ({}, "abcd"),
        ({"experiment": "cruise"}, "acd"),
        ({"experiment": "CRUISE"}, ""),
        ({"since": "2026-11-20"}, "bcd"),
        ({"until": "2026-11-20"}, "abc"),
        ({"since": "2026-11-20T09:00", "until": "2026-11-20"}, "c"),
        ({"rig": "bus 17"}, "cd"),
        ({"rig": text_sha256('schema = "hil.rig/1"\nname = "bus 17"\n')[:8]}, "cd"),
        ({"verdict": "explained"}, "a"),
        ({"verdict": "unexplained"}, ""),
        ({"text": "wind from"}, "b"),
        ({"text": "BACKLASH"}, "a"),
        ({"text": "permissive"}, "c"),
        ({"text": "bus 17", "verdict": "no_mismatch"}, "d"),
        ({"text": "100%_"}, ""),
    ],
)
def test_runs_are_found_by_what_is_asked(four: Path, wanted: dict[str, str], names: str) -> None:
    with RunStore(four) as store:
        assert "".join(run.entry.recording.stem for run in store.find(RunFilter(**wanted))) == names


def test_a_deleted_run_is_gone_with_all_that_is_its_own(four: Path) -> None:
    with RunStore(four) as store:
        runs = store.find()
        for run in runs[:2]:
            assert store.delete(run.run_id).entry == run.entry
        assert [run.run_id for run in store.find()] == [run.run_id for run in runs[2:]]
        with pytest.raises(UsageError, match=r"hil_runs: expected the number of a run, got 1, which is none"):
            store.get(runs[0].run_id)
    left = {path.name for path in (four / "hil_runs").iterdir() if path.name[0] in "12"}
    assert left == {"1.json", "2.json"}  # numbers that are not given again
    assert (four / "a.csv").exists()


def test_a_number_is_never_given_twice(four: Path, record: Record) -> None:
    with RunStore(four) as store:
        last = store.find()[-1].run_id
        store.delete(last)
    assert register_run(record("e.csv")) == last + 1


@pytest.mark.parametrize("call", ["note", "attach", "delete", "get", "move"])
def test_a_run_that_is_none_is_refused(tmp_path: Path, record: Record, call: str) -> None:
    register_run(record("a.csv"))
    more = {"note": ("x",), "attach": ("model", "x"), "move": (RunEntry(recording=tmp_path / "b.csv"),)}.get(call, ())
    with RunStore(tmp_path) as store, pytest.raises(UsageError, match="got 99, which is none"):
        getattr(store, call)(99, *more)


def test_a_store_moves_with_its_folder(tmp_path: Path, record: Record) -> None:
    home = tmp_path / "sub"
    register_run(record("sub/a.csv"))
    moved = home.rename(tmp_path / "elsewhere")
    with RunStore(moved) as store:
        assert store.find()[0].entry.recording.exists()


def test_results_go_with_a_registration(tmp_path: Path, record: Record) -> None:
    path = record("a.csv")
    companion = tmp_path / "a.online.json"
    companion.write_text(json.dumps({"final": {}}), encoding="utf-8")
    number = register_run(path, results={"online": companion})
    with RunStore(tmp_path) as store:
        assert [attachment.kind for attachment in store.get(number).attachments] == ["online"]
