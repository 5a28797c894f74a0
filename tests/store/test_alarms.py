"""Alarms of the on-line estimate in the store: one for each change, in the words of the run."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from estimator.identification.tracking.alarm import Alarm, Level
from hil.recording import read_table
from hil.store import RunStore, entry_of, register_run
from hil.store.entry import ONLINE, alarms_of, found_changes, results_of, run_facts
from hil.store.rebuild import ONLINE_SCHEMA
from hil.store.run_files import remove_files

Record = Callable[..., Path]


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
    assert path in remove_files(entry_of(read_table(recording)))
    assert not path.exists()
    assert not recording.exists()
