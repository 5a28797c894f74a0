"""The store from the recordings alone: what is entered, what is found again, what is left out."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from estimator.identification.tracking.alarm import Alarm, Level
from hil.errors import RunAborted
from hil.recording import RecordingWriter, read_table, write_table
from hil.recording.checksum import text_sha256
from hil.store import RunStore, attach_to_runs, entry_at, register_run, store_of
from hil.store.entry import COMPLETE, ONLINE, alarms_of, found_changes, results_of, run_facts
from hil.store.rebuild import ONLINE_SCHEMA, rebuild
from hil.store.run_files import VERIFIED, recording_state, remove_files
from tests.recording.test_writer import sample
from tests.store.conftest import RIG

Record = Callable[..., Path]


def test_runs_are_entered_and_everything_else_is_left_out(tmp_path: Path, record: Record) -> None:
    record("a.csv")
    record("sub/b.mf4")
    write_table(read_table(tmp_path / "a.csv"), tmp_path / "copy_of_a.h5")
    (tmp_path / "foreign.csv").write_text("t,v\n0,1\n", encoding="utf-8")
    (tmp_path / "broken.parquet").write_bytes(b"PAR1")
    (tmp_path / ".hidden.csv").write_text("x\n", encoding="utf-8")
    result = rebuild(tmp_path)
    assert (result.before, result.found, result.moved, result.copies) == (0, 2, 0, 1)
    (problem,) = result.unreadable
    assert "broken.parquet" in problem
    again = rebuild(tmp_path)
    assert (again.before, again.found, again.copies) == (2, 0, 1)


def test_a_moved_recording_is_found_again_with_its_notes(tmp_path: Path, record: Record) -> None:
    number = register_run(record("a.parquet"))
    with RunStore(tmp_path) as store:
        store.note(number, "wind")
        (tmp_path / "a.parquet").rename(tmp_path / "renamed.parquet")
        assert recording_state(store.get(number).entry).startswith("missing")
    assert rebuild(tmp_path).moved == 1
    with RunStore(tmp_path) as store:
        (run,) = store.find()
    assert (run.run_id, run.entry.recording.name, run.notes[0].text) == (number, "renamed.parquet", "wind")
    assert recording_state(run.entry) == VERIFIED


def test_what_ended_a_run_is_reported_by_the_recording_itself(tmp_path: Path) -> None:
    said = {"experiment": "cruise", "rig_file": RIG, "rig_sha256": text_sha256(RIG)}

    def run(name: str, samples: int, ended_by: Exception | None = None) -> None:
        with RecordingWriter(tmp_path / name, said) as writer:
            for k in range(samples):
                writer.append(sample(k))
            if ended_by is not None:
                raise ended_by

    run("whole.parquet", 9)
    with pytest.raises(RunAborted):
        run("cut.parquet", 3, RunAborted("PLC: clutch is closed"))
    rebuild(tmp_path)
    with RunStore(tmp_path) as store:
        outcomes = {run.entry.recording.name: run.entry.outcome for run in store.find()}
    assert outcomes == {"cut.parquet": "PLC: clutch is closed", "whole.parquet": COMPLETE}


def test_results_in_the_folder_are_attached_once_to_the_runs_they_name(tmp_path: Path, record: Record) -> None:
    for name in "abc":
        record(f"{name}.csv")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "diagnosis.json").write_text(
        json.dumps({"verdict": "explained", "load_torque": {"a": {}}, "mismatch": {"time_s": {"b": []}}}), "utf-8"
    )
    (tmp_path / "out" / "identification.json").write_text(json.dumps({"recordings": [{"name": "c"}, 3]}), "utf-8")
    (tmp_path / "a.online.json").write_text("{}", "utf-8")
    (tmp_path / "diagnosis.json").write_text("[broken", "utf-8")
    assert rebuild(tmp_path).attached == 4
    assert rebuild(tmp_path).attached == 0
    with RunStore(tmp_path) as store:
        runs = store.find()
    kinds = {run.entry.recording.stem: [entry.kind for entry in run.attachments] for run in runs}
    assert kinds == {"a": ["online", "diagnosis"], "b": ["diagnosis"], "c": ["identification"]}
    assert [run.verdict for run in runs] == ["explained", "explained", ""]


def test_what_a_recording_became_is_reported(tmp_path: Path, record: Record) -> None:
    number = register_run(record("a.csv"))
    with RunStore(tmp_path) as store:
        entry = store.get(number).entry
    path = entry.recording
    assert recording_state(entry) == VERIFIED
    whole = path.read_text(encoding="utf-8")
    path.write_text(whole.replace("0.01,", "0.02,"), encoding="utf-8")
    assert "damaged, or was changed" in recording_state(entry)
    path.write_text(whole, encoding="utf-8")
    for companion in ("", ".json"):
        (tmp_path / f"a.csv{companion}").unlink()
    other = record("b.csv")
    other.rename(path)
    (tmp_path / "b.csv.json").rename(tmp_path / "a.csv.json")
    assert "another recording under the same name" in recording_state(entry)


def test_results_are_attached_to_the_runs_they_are_of(tmp_path: Path, record: Record) -> None:
    here, other = record("a.csv"), record("sub/b.csv")
    register_run(here)
    result = tmp_path / "diagnosis.json"
    result.write_text('{"verdict": "unexplained"}', encoding="utf-8")
    assert attach_to_runs([here, other, record("c.csv")], {"diagnosis": result}) == []
    with RunStore(tmp_path) as store:
        assert [run.verdict for run in store.find()] == ["unexplained"]
    assert not store_of(other.parent).exists()  # a result makes no store
    shutil.rmtree(store_of(tmp_path))
    store_of(tmp_path).write_bytes(b"x" * 5000)
    (complaint,) = attach_to_runs([here], {"diagnosis": result})
    assert "expected a folder, got a file of that name" in complaint
    assert "The results are whole" in complaint


def alarm(after_hz: float, settled: bool) -> Alarm:
    """A resonance that fell from 8.2 Hz."""
    before, after = Level(8.2, (8.1, 8.3)), Level(after_hz, (after_hz - 0.1, after_hz + 0.1))
    return Alarm(60.0, (50.0, 55.0), "resonance_hz", before, after, settled, 31.0, 12.0, 0.01)


ON_ITS_WAY, SETTLED, ANOTHER = alarm(7.9, False), alarm(7.6, True), alarm(7.0, False)


def course(*alarms: Alarm) -> dict[str, Any]:
    """An .online.json with these alarms."""
    return {"schema": "hil.online/1", "alarms": [one.as_json() for one in alarms]}


@pytest.mark.parametrize(
    ("alarms", "changes"),
    [
        ((), ()),
        ((ON_ITS_WAY,), (ON_ITS_WAY,)),
        ((ON_ITS_WAY, SETTLED), (SETTLED,)),
        ((ON_ITS_WAY, SETTLED, ANOTHER), (SETTLED, ANOTHER)),
    ],
)
def test_a_change_counts_once(
    tmp_path: Path, record: Record, alarms: tuple[Alarm, ...], changes: tuple[Alarm, ...]
) -> None:
    document = course(*alarms)
    assert found_changes(document) == [change.as_json() for change in changes]
    path = tmp_path / "a.online.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    number = register_run(record("a.csv"), results={ONLINE: path})
    with RunStore(tmp_path) as store:
        (listed,), run = store.find(), store.get(number)
    assert listed.alarms == run.alarms == run_facts(run)["alarms"] == len(changes)
    assert results_of(run)["alarms while driving"] == len(changes)
    assert alarms_of(run) == [change.statement for change in changes]


def test_the_last_estimate_counts(tmp_path: Path, record: Record) -> None:
    number = register_run(record("a.csv"))
    with RunStore(tmp_path) as store:
        assert store.get(number).alarms == 0
        store.attach(number, ONLINE, course(SETTLED))
        store.attach(number, ONLINE, course())
        assert store.get(number).alarms == 0


@pytest.mark.parametrize("text", ["no JSON", "[]", "{}", '{"alarms": 3}', '{"alarms": [3, "x"]}'])
def test_another_programs_document_has_no_alarms(tmp_path: Path, record: Record, text: str) -> None:
    number = register_run(record("a.csv"))
    with RunStore(tmp_path) as store:
        store.attach(number, ONLINE, text)
        assert alarms_of(store.get(number)) == []
        assert store.get(number).alarms == 0


def test_a_recording_that_is_deleted_takes_its_course_along(tmp_path: Path, record: Record) -> None:
    recording = record("a.csv")
    path = tmp_path / "a.online.json"
    path.write_text(json.dumps({"schema": ONLINE_SCHEMA}), encoding="utf-8")
    assert path in remove_files(entry_at(recording))
    assert not path.exists()
    assert not recording.exists()
