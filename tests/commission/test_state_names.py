"""The state file of a commissioning may be someone else's: the recordings it names are in its folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.commission.state import FILE_NAME, RunRecord, State, Status, StepRecord, load_state
from hil.errors import UsageError


def saved(folder: Path, recording: str) -> None:
    run = RunRecord("cruise", recording, whole=True, seconds=1.0, predicted={}, measured={})
    State(folder, "bench", "rig.toml", "", {"noise": StepRecord(Status.DONE, runs=[run])}).save()


def test_a_recording_next_to_the_state_is_taken(tmp_path: Path) -> None:
    saved(tmp_path, "recordings/cruise.csv")
    assert load_state(tmp_path, ["noise"]) is not None


@pytest.mark.parametrize("recording", ["/etc/passwd", "../cruise.csv", "x/../../cruise.csv", ""])
def test_one_that_leads_elsewhere_is_refused(tmp_path: Path, recording: str) -> None:
    saved(tmp_path, recording)
    with pytest.raises(UsageError, match=f"{FILE_NAME}: .*run cruise: a recording outside"):
        load_state(tmp_path, ["noise"])


def test_a_state_nested_too_deep_is_refused(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_text("[" * 5000)
    with pytest.raises(UsageError, match="nested too deep"):
        load_state(tmp_path, ["noise"])
