"""From any format to any other and back: no number, text, unit or metadata is lost, or the loss is reported."""

from __future__ import annotations

import itertools
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from hil.errors import RecordingError
from hil.recording import Table, read_table, write_table
from hil.recording.checksum import CHECKSUMS
from hil.recording.description import sidecar_of
from hil.recording.formats import FORMATS, read_metadata
from hil.recording.publish import losses
from hil.recording.table import as_text
from tests.chosen import one_in

WRITABLE = [suffix for suffix, form in FORMATS.items() if form.write]

floats = st.floats(allow_nan=True, allow_infinity=True, width=64)
integers = st.integers(min_value=-(2**63), max_value=2**63 - 1)
lines = st.text(st.characters(codec="utf-8", exclude_characters="\0\n\r"), max_size=8)
texts = st.one_of(lines, st.sampled_from(["", " ", "1", "-0", "nan", "True", "1e5", "a,b", 'say "a"', " x "]))
plain_names = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), min_size=1, max_size=12)
names = st.one_of(plain_names, st.sampled_from(["time_s", "Throttle [%]", "a/b", "a\\b", ".", "1st", "x y"]))
words = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20)


@st.composite
def tables(draw: st.DrawFn) -> Table:
    n = draw(st.integers(1, 12))
    kinds = {"float": floats, "integer": integers, "boolean": st.booleans(), "text": texts}
    columns = {}
    for name in draw(st.lists(names, min_size=1, max_size=5, unique=True)):
        kind = draw(st.sampled_from(list(kinds)))
        cells = draw(st.lists(kinds[kind], min_size=n, max_size=n))
        dtype = {"float": np.float64, "integer": np.int64, "boolean": np.bool_}.get(kind)
        columns[name] = as_text(cells) if dtype is None else np.array(cells, dtype=dtype)
    units = {name: draw(words) for name in columns if draw(st.booleans())}
    metadata = draw(st.dictionaries(st.sampled_from(["experiment", "rig_file", "note", "a b", "ö"]), words))
    return Table(Path("a.csv"), columns, units, metadata)


@given(tables(), st.permutations(WRITABLE))
@example(Table(Path("a.csv"), {"0": as_text([" ", ""])}), list(WRITABLE))
@settings(max_examples=15, deadline=None)
def test_through_every_format_in_any_order_nothing_is_lost(table: Table, order: list[str]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        now = table
        for number, suffix in enumerate([*order, order[0]]):
            path = Path(folder) / f"{number}{suffix}"
            write_table(now, path)
            now = read_table(path)
            assert dict(read_metadata(path)) == dict(now.metadata)
        assert losses(table, now) == []
        assert set(now.metadata) <= {*table.metadata, *CHECKSUMS, "schema"}
        assert dict(table.units).items() <= dict(now.units).items()  # a name may tell a unit, too


@pytest.fixture
def every_kind() -> Table:
    """A recording with columns of each kind, and cells that are easily lost."""
    return Table(
        Path("run.csv"),
        {
            "n": np.array([-(2**63), 2**53 + 1, 2**63 - 1, 0]),
            "time_s": np.array([0.0, 0.1, 0.2, 0.30000000000000004]),
            "Speed [km/h]": np.array([np.nan, -0.0, np.inf, 5e-324]),
            "speed_km_h_": np.array([1.0, 2.0, 3.0, 4.0]),
            "on": np.array([True, False, False, True]),
            "gear": as_text(["", " 1", "Ö\u2028\U0001f600", "007"]),
        },
        {"time_s": "s", "Speed [km/h]": "km/h", "n": ""},
        {"experiment": "cruise", "rig_file": "  a = 1\n\n# ü\t\n", "empty": ""},
    )


@pytest.mark.parametrize(("first", "second"), one_in(4, itertools.product(WRITABLE, WRITABLE)))
def test_each_pair_of_formats_round_trips(tmp_path: Path, every_kind: Table, first: str, second: str) -> None:
    for suffix, name in ((first, "a"), (second, "b"), (first, "c")):
        every_kind = replace(every_kind, path=tmp_path / name)
        write_table(every_kind, tmp_path / f"{name}{suffix}")
        read = read_table(tmp_path / f"{name}{suffix}")
        assert losses(every_kind, read) == []
        assert list(read.columns) == list(every_kind.columns)
        every_kind = read


@given(texts=st.lists(st.text(st.characters(codec="utf-8"), max_size=4), min_size=1, max_size=4))
@settings(max_examples=12, deadline=None)
def test_any_text_is_kept_or_refused_by_its_column(texts: list[str]) -> None:
    for suffix in WRITABLE:
        table = Table(Path("a"), {"time_s": np.arange(float(len(texts))), "word": as_text(texts)})
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"a{suffix}"
            refusal = refusal_of(table, path)
            assert "column word" in refusal or losses(table, read_table(path)) == []
            assert not refusal or list(Path(folder).iterdir()) == []


def refusal_of(table: Table, path: Path) -> str:
    try:
        write_table(table, path)
    except RecordingError as error:
        return str(error)
    return ""


def test_what_is_lost_is_reported_and_the_rest_is_kept_with_a_checksum_of_its_own(tmp_path: Path) -> None:
    """A NUL ends a text in MDF."""
    table = Table(Path("a"), {"x": np.arange(2.0), "word": as_text(["a\0b", "c"])}, {"x": "m"}, {"note": "kept"})
    said: list[str] = []
    write_table(table, tmp_path / "a.mf4", on_loss=said.extend)
    assert said == ["column word: 1 of 2 cells change, the first in row 1: 'a\\x00b' becomes 'a'"]
    read = read_table(tmp_path / "a.mf4")
    assert read.columns["word"].tolist() == ["a", "c"]
    assert (read.units["x"], read.metadata["note"]) == ("m", "kept")


def test_a_replaced_recording_never_has_the_old_ones_description(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.csv"
    old = Table(path, {"time_s": np.arange(3.0)}, {"time_s": "s"}, {"experiment": "old"})
    write_table(old, path)
    rename = Path.replace

    def killed_between_the_two(part: Path, target: Path) -> Path:
        if target == sidecar_of(path):
            raise OSError("killed")
        return rename(part, target)

    monkeypatch.setattr(Path, "replace", killed_between_the_two)
    with pytest.raises(RecordingError, match="killed"):
        write_table(
            replace(old, columns={"time_s": np.arange(4.0)}, metadata={"experiment": "new"}), path, replace=True
        )
    assert read_table(path).columns["time_s"].size == 4
    assert "experiment" not in read_metadata(path)
    assert [each.name for each in tmp_path.iterdir()] == ["run.csv"]
