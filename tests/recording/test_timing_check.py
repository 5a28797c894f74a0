"""Recordings whose cycles were too uneven are refused by identification, with what was counted."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from hil.errors import RecordingError
from hil.recording import Table, write_table
from hil.recording.description import sidecar_of
from hil.recording.formats import read_metadata
from hil.recording.recordings import WORST_SHARE, require_even_cycles

EVEN = {"cycles": 1000, "missed": 0, "late": 0, "unanswered": 0}


@pytest.fixture
def recorded(tmp_path: Path, own_table: Table) -> Callable[..., Path]:
    def write(suffix: str, text: str) -> Path:
        path = tmp_path / f"run{suffix}"
        metadata = {"schema": "hil.recording/1", "timing": text}
        write_table(replace(own_table, path=path, metadata=metadata), path)
        return path

    return write


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@pytest.mark.parametrize("fault", ["missed", "late", "unanswered"])
def test_too_many_bad_cycles_are_refused_and_a_few_are_not(
    recorded: Callable[..., Path], suffix: str, fault: str
) -> None:
    few = round(WORST_SHARE * 1000)
    path = recorded(suffix, json.dumps({**EVEN, fault: few}))
    require_even_cycles([path])
    path.unlink()
    sidecar_of(path).unlink(missing_ok=True)
    path = recorded(suffix, json.dumps({**EVEN, fault: 2 * few}))
    with pytest.raises(RecordingError, match=rf"at most 5% of the cycles .* {2 * few} .*Record again"):
        require_even_cycles([path])


@pytest.mark.parametrize("text", ["", "[]", '{"cycles": 3}', '{"cycles": "many", "missed": 0}'])
def test_record_that_can_not_be_read_is_refused(recorded: Callable[..., Path], text: str) -> None:
    with pytest.raises(RecordingError, match=r"metadata timing: expected a record hil\.timing/1"):
        require_even_cycles([recorded(".parquet", text)])


def test_file_next_to_that_is_not_ours_is_left_alone(tmp_path: Path, own_table: Table) -> None:
    path = tmp_path / "run.csv"
    write_table(replace(own_table, units={}, metadata={}), path)
    sidecar_of(path).write_text('{"schema": "another", "timing": "x"}', encoding="utf-8")
    assert read_metadata(path) == {}
    path.unlink()
    with pytest.raises(RecordingError, match="describes another recording"):
        write_table(own_table, path)
    assert list(tmp_path.iterdir()) == [sidecar_of(path)]
