"""Damaged recordings of every format: refused by name with what was expected, or read as they were; never wrong."""

from __future__ import annotations

import random
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil.errors import RecordingError
from hil.recording import RecordingWriter, Table, read_table, write_table
from hil.recording.checksum import CHECKSUMS, data_sha256, sealed, text_sha256
from hil.recording.formats import FORMATS
from hil.recording.publish import losses
from hil.recording.table import as_text
from tests.chosen import one_in
from tests.full_disk import largest_file

WRITABLE = [suffix for suffix, form in FORMATS.items() if form.write]

TRIALS = {".mf4": 12}
"""A damaged MDF file may end its reader, and a new one takes a second to start; the others take milliseconds."""


@pytest.fixture
def reported(own_table: Table) -> Table:
    """A recording that says something of itself, with a text column: where MDF's own parser can be led astray."""
    columns = {**own_table.columns, "gear": as_text([f"gear {k % 5}" for k in range(own_table.n_rows)])}
    rig = 'name = "bench"\n' * 20
    return Table(
        own_table.path, columns, own_table.units, {"rig_file": rig, "rig_sha256": text_sha256(rig), "experiment": "tip"}
    )


def damaged(whole: bytes, dice: random.Random) -> bytes:
    place = dice.randrange(len(whole))
    return dice.choice(
        [
            whole[:place],
            whole[:place] + bytes([whole[place] ^ 1 << dice.randrange(8)]) + whole[place + 1 :],
            whole[:place] + dice.randbytes(32) + whole[place + 32 :],
            whole[:place] + whole[place + 1 :],
        ]
    )


@pytest.mark.parametrize("suffix", one_in(2, WRITABLE))
def test_a_damaged_recording_is_refused_or_read_as_it_was(tmp_path: Path, reported: Table, suffix: str) -> None:
    path, dice = tmp_path / f"run{suffix}", random.Random(4)
    write_table(reported, path)
    whole = path.read_bytes()
    trials = TRIALS.get(suffix, 60)
    read = []
    for _ in range(trials):
        path.write_bytes(damaged(whole, dice))
        read.append(read_or_refusal(path))
    refusals = [found for found in read if isinstance(found, str)]
    assert all(str(path) in refusal for refusal in refusals)
    assert len(refusals) > trials / 2
    for table in read:
        if not isinstance(table, str):
            assert [loss for loss in losses(reported, table) if loss.startswith("column")] == []
            assert {
                key: value for key, value in table.metadata.items() if key in reported.metadata
            } == reported.metadata
            assert {name: unit for name, unit in table.units.items() if unit} == {
                n: u for n, u in reported.units.items() if u
            }


def read_or_refusal(path: Path) -> Table | str:
    try:
        return read_table(path)
    except RecordingError as refusal:
        return str(refusal)


def test_the_checksum_knows_cells_names_and_kinds_and_nothing_else(reported: Table) -> None:
    columns = dict(reported.columns)
    checksum = data_sha256(columns)
    assert data_sha256(dict(reversed(columns.items()))) == checksum
    time_s = columns["time_s"]
    others = (
        columns | {"time_s": time_s + 1e-9},
        columns | {"time_s": time_s[:-1]},
        columns | {"flags": columns["flags"] == 1},
        columns | {"flags": columns["flags"].astype(float)},
        {("t" if name == "time_s" else name): column for name, column in columns.items()},
        columns | {"gear": as_text(["gear", " 0", *columns["gear"].tolist()[2:]])},
    )
    assert len({checksum, *(data_sha256(other) for other in others)}) == len(others) + 1


@pytest.mark.parametrize("suffix", WRITABLE)
@pytest.mark.parametrize(
    "content", [b"", b"PAR1", b"MDF     4.10", b"MATLAB 7.3 MAT-file", b"\x89HDF\r\n\x1a\n", b"\xff"]
)
def test_what_is_no_recording_is_refused_by_name(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"run{suffix}"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=rf"run{suffix}: .*expected"):
        read_table(path)


@pytest.mark.parametrize("suffix", WRITABLE)
@pytest.mark.parametrize("existing", [False, True])
def test_a_full_disk_leaves_what_was_there(tmp_path: Path, reported: Table, suffix: str, existing: bool) -> None:
    path = tmp_path / f"run{suffix}"
    old = replace(reported, metadata={"experiment": "old"})
    if existing:
        write_table(old, path)
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    refusal = pytest.raises(RecordingError, match=rf"run{suffix}.*: expected room for the .*, got: .*File too large")
    with refusal, largest_file(1000):
        write_table(reported, path, replace=True)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_a_full_disk_at_the_end_of_a_run_costs_the_description_and_no_sample(tmp_path: Path) -> None:
    from tests.recording.test_writer import sample

    def run() -> None:
        with ExitStack() as full, RecordingWriter(tmp_path / "run.csv", {"note": "x" * 100_000}) as writer:
            for k in range(20):
                writer.append(sample(k))
            full.enter_context(largest_file(50_000))

    with pytest.raises(RecordingError, match=r"run\.csv\.json: expected room for the description"):
        run()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.csv", "run.csv.json"]
    assert read_table(tmp_path / "run.csv").n_rows == 20


@pytest.mark.parametrize("suffix", WRITABLE)
def test_a_place_that_takes_no_file_is_reported(reported: Table, suffix: str) -> None:
    path = Path(f"/proc/run{suffix}")
    with pytest.raises(RecordingError, match=rf"/proc/run{suffix}: expected room for the recording, got: "):
        write_table(reported, path)


@pytest.mark.parametrize("suffix", WRITABLE)
@pytest.mark.parametrize(
    "other",
    [
        {"units": {"x": "gurlongs"}},
        {"units": {}},
        {"metadata": {"operator": "vindyday"}},
        {"metadata": {"nperator": "windyday"}},
        {"metadata": {}},
        {"metadata": {"operator": "windyday", "more": ""}},
    ],
)
def test_what_a_recording_says_of_itself_is_what_it_was_written_with(
    tmp_path: Path, suffix: str, other: dict[str, dict[str, str]]
) -> None:
    """As if a bit had flipped in a unit, a key or a text, wherever a format keeps them."""
    whole = sealed(Table(tmp_path / "x", {"x": np.arange(4.0)}, {"x": "furlongs"}, {"operator": "windyday"}))
    said = {key: whole.metadata[key] for key in CHECKSUMS}
    changed = replace(whole, **({**other, "metadata": other["metadata"] | said} if "metadata" in other else other))
    for table, holds in ((whole, True), (changed, False)):
        path = tmp_path / f"run_{holds}{suffix}"
        write = FORMATS[suffix].write
        assert write is not None
        write(table, path)
        if holds:
            assert read_table(path).units == {"x": "furlongs"}
        else:
            with pytest.raises(RecordingError, match="expected the units and metadata it was written with, SHA-256"):
                read_table(path)
