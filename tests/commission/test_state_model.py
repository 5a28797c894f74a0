"""A state file of someone else: whatever stands in it ends in a page or in one message, never in a traceback."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hil.commission.engine import STEPS
from hil.commission.state import FILE_NAME, load_state
from hil.commission.talk import result_document, result_lines
from hil.errors import UsageError
from hil.report.commission_html import commission_page
from tests.commission.whole_state import whole_state

TITLES = {step.name: step.title for step in STEPS}
GONE = object()
WRONG = (GONE, None, True, -1, 0, 1e300, float("nan"), "", "0001-01-01T00:00:00+14:00", [], [[]], {}, {"x": 1})
FEWEST_MUTATIONS = 700


def places(value: Any, *way: str | int) -> Iterator[tuple[str | int, ...]]:
    """Return the way to every value of a document; of lists with like members the first two."""
    if way:
        yield way
    if isinstance(value, dict):
        for key, each in value.items():
            yield from places(each, *way, key)
    elif isinstance(value, list):
        for number, each in enumerate(value[:2]):
            yield from places(each, *way, number)


def changed(document: Any, way: tuple[str | int, ...], value: Any) -> Any:
    document = copy.deepcopy(document)
    at = document
    for key in way[:-1]:
        at = at[key]
    if value is GONE:
        del at[way[-1]]
    else:
        at[way[-1]] = value
    return document


def lean(document: Any, way: tuple[str | int, ...]) -> Any:
    """Leave out the evidence that this way does not lead into: to draw it takes longest."""
    steps = {
        name: step if "evidence" in way and name in way else step | {"evidence": {}}
        for name, step in document["steps"].items()
    }
    return document | {"steps": steps}


def read(folder: Path, document: Any) -> str | None:
    """Read a state and make all that is made of it; None where it was refused."""
    (folder / FILE_NAME).write_text(json.dumps(document), encoding="utf-8")
    try:
        state = load_state(folder, TITLES)
    except UsageError as error:
        assert str(error).startswith(f"{folder / FILE_NAME}: expected the state of a commissioning")  # noqa: PT017
        return None
    assert state is not None
    list(result_lines(result_document(state.document(), str(folder), None)))
    return commission_page(state.document(), TITLES)


def test_a_whole_state_is_read_and_drawn(tmp_path: Path) -> None:
    page = read(tmp_path, whole_state(tmp_path).document())
    assert page is not None
    assert page.count('class="plotly-graph-div"') == 8


def test_every_wrong_value_ends_in_a_page_or_in_one_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.report.page._packed", lambda _content: "")  # what figures hold is not looked at here
    document = whole_state(tmp_path).document()
    mutations = [(way, value) for way in places(document) for value in WRONG]
    assert len(mutations) >= FEWEST_MUTATIONS
    mutations = mutations[:: len(mutations) // FEWEST_MUTATIONS]
    refused = sum(read(tmp_path, changed(lean(document, way), way, value)) is None for way, value in mutations)
    assert refused > len(mutations) // 2


@pytest.mark.parametrize(
    ("way", "value", "message"),
    [
        (
            ("steps", "noise", "evidence", "course", "time_s"),
            [0.0, 1.0, 0.5],
            "time_s | expected moments that increase",
        ),
        (("steps", "noise", "evidence", "course", "speed_rad_s"), [0.0], "expected 3 values, as many as in time_s"),
        (("steps", "scales", "evidence", "spread"), GONE, "expected resonance and spread, or neither"),
        (("steps", "validation", "evidence", "model", "parameters", "k"), [-1.0, 0.2], "those of a driveline model"),
        (("steps", "friction", "ended_utc"), "yesterday", "steps.friction.ended_utc"),
    ],
)
def test_a_message_names_the_key(tmp_path: Path, way: tuple[str | int, ...], value: Any, message: str) -> None:
    document = changed(whole_state(tmp_path).document(), way, value)
    (tmp_path / FILE_NAME).write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(UsageError) as refusal:
        load_state(tmp_path, TITLES)
    assert message in str(refusal.value)
