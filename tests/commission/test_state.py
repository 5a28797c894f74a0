"""The folder of a commissioning: held by one call at a time, and a state file that may be a stranger's."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hil.cli.main import run
from hil.commission.engine import NAMES
from hil.commission.state import FILE_NAME, CommissioningState, Status, StepRecord, load_state
from hil.errors import UsageError
from hil.orders.runner import RunRecord
from hil.report.commission_html import commission_page
from hil.result_folder import LOCK, sole_use
from tests.cli.conftest import EXAMPLE
from tests.commission.whole_state import whole_state


def saved(folder: Path, recording: str) -> None:
    run = RunRecord("cruise", recording, whole=True, seconds=1.0, predicted={}, measured={})
    CommissioningState(folder, "bench", "rig.toml", "", {"noise": StepRecord(Status.DONE, runs=[run])}).save()


def test_a_recording_next_to_the_state_is_taken(tmp_path: Path) -> None:
    saved(tmp_path, "recordings/cruise.csv")
    assert load_state(tmp_path, ["noise"]) is not None


@pytest.mark.parametrize("recording", ["/etc/passwd", "../cruise.csv", "x/../../cruise.csv", ""])
def test_one_that_leads_elsewhere_is_refused(tmp_path: Path, recording: str) -> None:
    saved(tmp_path, recording)
    with pytest.raises(UsageError, match=f"{FILE_NAME}: .*run cruise: a recording outside"):
        load_state(tmp_path, ["noise"])


HOLDER = """
import sys
from pathlib import Path
from hil.result_folder import sole_use
with sole_use(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def holder(folder: Path) -> subprocess.Popen[str]:
    """Start a process that holds a folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process


def test_second_call_is_refused_by_name_of_the_first_and_leaves_everything(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = holder(tmp_path)
    try:
        nowhere = ("--bus", "ws://127.0.0.1:9/", "--modbus", "127.0.0.1:9")
        assert run(["commission", str(EXAMPLE), "--out", str(tmp_path), "--yes", *nowhere]) == 2
        assert f"got process {first.pid}." in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir()] == [LOCK]
    finally:
        first.communicate("")


@pytest.mark.parametrize("killed", [False, True])
def test_folder_is_free_once_its_holder_has_ended_however_it_did(killed: bool, tmp_path: Path) -> None:
    first = holder(tmp_path)
    if killed:
        first.kill()
    first.communicate("" if not killed else None)
    with sole_use(tmp_path), pytest.raises(UsageError, match="expected no other call"), sole_use(tmp_path):
        pass
    with sole_use(tmp_path):
        assert (tmp_path / LOCK).exists()


ODD = (None, "x", "2026-99-99", "javascript:x", -1, 1e300, [], [1.0], {}, {"a": 1}, True)


def saved_whole(folder: Path) -> dict[str, Any]:
    """Write a state with everything that a state may have; return what its file says."""
    state = whole_state(folder)
    state.save()
    document: dict[str, Any] = json.loads(state.path.read_text(encoding="utf-8"))
    return document


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    yield path
    for key, each in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places(each, (*path, key))


def put(document: Any, path: tuple[Any, ...], value: Any) -> Any:
    """A copy with one place changed."""
    if not path:
        return value
    copy = dict(document) if isinstance(document, dict) else list(document)
    copy[path[0]] = put(document[path[0]], path[1:], value)
    return copy


def test_a_state_is_read_as_it_was_written(tmp_path: Path) -> None:
    document = saved_whole(tmp_path)
    state = load_state(tmp_path, NAMES)
    assert state is not None
    again = json.loads(json.dumps(state.document()))
    assert again | {"updated_utc": ""} == document | {"updated_utc": ""}


def test_whatever_is_changed_in_a_state_it_is_refused_by_place_or_read(tmp_path: Path) -> None:
    """Every place of the file, with every odd value: 700 of a stranger's mutations ended 22 times in a traceback."""
    document = saved_whole(tmp_path)
    path, refusals, read = tmp_path / FILE_NAME, [], {}
    for number, place in enumerate(list(places(document))[::3]):
        path.write_text(json.dumps(put(document, place, ODD[number % len(ODD)])), encoding="utf-8")
        try:
            state = load_state(tmp_path, NAMES)
        except UsageError as refusal:
            refusals.append(str(refusal))
            continue
        assert state is not None
        read[place[1:4:2]] = state  # one for each kind of place
    assert len(refusals) > 100
    assert all("can't be read as one" in each for each in refusals)
    for state in list(read.values())[::4]:  # what is read can be shown
        commission_page(state.document(), {name: name for name in NAMES})
