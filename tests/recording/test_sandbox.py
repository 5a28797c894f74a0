"""A file that a library can't be trusted with: its reader is bounded in memory and time, and ends alone."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import textwrap
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from hil.child import python
from hil.errors import RecordingError
from hil.recording import Table, read_table, sandbox as apart, write_table
from hil.recording.bounds import CELLS, MEMORY_BYTES
from hil.recording.formats import FORMATS, read_metadata
from hil.recording.request import Request
from hil.recording.sandbox import ENVIRONMENT, Reader
from hil.recording.table import as_text
from tests.chosen import campaign

GIB = 1 << 30


def peak_bytes(path: Path) -> int:
    """Read a file in a process of its own, and return the most memory of it and its reader, whatever comes of it."""
    program = f"""
        import resource
        from hil.errors import RecordingError
        from hil.recording import read_table
        from hil.recording.sandbox import READER
        try:
            read_table({str(path)!r})
        except RecordingError as error:
            print(error)
        READER.end()
        print(sum(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))
    """
    # By a shell that stays: a process that is forked from this one begins with this one's peak.
    command = ["/bin/sh", "-c", '"$@"; exit $?', "sh", *python("-c", textwrap.dedent(program))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=True)
    *said, peak = done.stdout.splitlines()
    assert any(str(path) in line for line in said), done.stdout
    return int(peak) * 1024


def sparse_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("speed", shape=(10**12,), dtype="f8", chunks=(1 << 20,), fillvalue=1.0)


def many_sparse_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name in "abcdefgh":
            file.create_dataset(name, shape=(CELLS - 1,), dtype="f8", chunks=(1 << 20,))


def wide_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("table", shape=(10**4,), dtype=np.dtype([("x", "f8", (10**5,))]), chunks=(1,))


def sparse_mat73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("v", shape=(1, 10**11), dtype="f8", chunks=(1, 1 << 20))
    content = bytearray(path.read_bytes())
    content[:20] = b"MATLAB 7.3 MAT-file "
    path.write_bytes(content)


def bomb_parquet(path: Path) -> None:
    zeros = pa.chunked_array([pa.array(np.zeros(1 << 22))] * 40)
    pa.parquet.write_table(pa.table({"x": zeros}), path, compression="zstd")


def text_parquet(path: Path) -> None:
    """One long text, referred to by every row."""
    texts = pa.DictionaryArray.from_arrays(pa.array(np.zeros(10**5, dtype=np.int32)), pa.array(["x" * 10**6]))
    pa.parquet.write_table(pa.table({"t": texts}), path, compression="zstd")


BOMBS: list[tuple[str, Callable[[Path], None]]] = [
    (".h5", sparse_hdf5),
    (".parquet", bomb_parquet),
    (".h5", many_sparse_hdf5),
    (".h5", wide_hdf5),
    (".mat", sparse_mat73),
    (".parquet", text_parquet),
]


@pytest.mark.parametrize(
    ("suffix", "make"), [*BOMBS[:2], *map(campaign, BOMBS[2:])], ids=[make.__name__ for _, make in BOMBS]
)
def test_a_small_file_that_unpacks_to_much_is_refused_and_takes_little(
    tmp_path: Path, suffix: str, make: Callable[[Path], None]
) -> None:
    path = tmp_path / f"bomb{suffix}"
    make(path)
    assert path.stat().st_size < 4 << 20
    assert peak_bytes(path) < GIB


@pytest.mark.parametrize("n_bytes", [3 * GIB])
def test_a_compressed_mat_file_is_unpacked_no_further_than_allowed(tmp_path: Path, n_bytes: int) -> None:
    """Made by hand: scipy would need the memory itself. The variable is a vector of zeros behind zlib (version 5)."""
    path = tmp_path / "bomb.mat"
    rows = n_bytes // 8
    flags = (6).to_bytes(4, "little") + (8).to_bytes(4, "little") + (6).to_bytes(4, "little") + bytes(4)
    shape = (
        (5).to_bytes(4, "little") + (8).to_bytes(4, "little") + rows.to_bytes(4, "little") + (1).to_bytes(4, "little")
    )
    name = (1).to_bytes(2, "little") + (1).to_bytes(2, "little") + b"v\0\0\0"
    head = flags + shape + name + (9).to_bytes(4, "little") + (n_bytes & 0xFFFFFFFF).to_bytes(4, "little")
    packing = zlib.compressobj(9)
    element = (14).to_bytes(4, "little") + ((len(head) + n_bytes) & 0xFFFFFFFF).to_bytes(4, "little") + head
    packed = packing.compress(element) + packing.flush(zlib.Z_FULL_FLUSH)
    zeros = packing.compress(bytes(1 << 24)) + packing.flush(zlib.Z_FULL_FLUSH)  # stands alone, so it can be repeated
    packed += zeros * (n_bytes >> 24) + packing.flush()
    with path.open("wb") as file:
        file.write(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM")
        file.write((15).to_bytes(4, "little") + len(packed).to_bytes(4, "little") + packed)
    assert peak_bytes(path) < GIB


@pytest.mark.parametrize("kind", ["external link", "external storage", "virtual"])
def test_content_in_another_file_is_refused(tmp_path: Path, kind: str) -> None:
    other = tmp_path / "secret.bin"
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = np.arange(10.0)
    other.write_bytes(bytes(80))
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["time"] = np.arange(10.0)
        group = file.create_group("deep")
        if kind == "external link":
            group["x"] = h5py.ExternalLink("other.h5", "x")
        elif kind == "external storage":
            group.create_dataset("x", (10,), "f8", external=[(str(other), 0, 80)])
        else:
            layout = h5py.VirtualLayout((10,), "f8")
            layout[:] = h5py.VirtualSource("other.h5", "x", (10,))
            group.create_virtual_dataset("x", layout)
    with pytest.raises(
        RecordingError, match=r"run\.h5: deep/x: expected data in this file, got a reference to another"
    ):
        read_table(tmp_path / "run.h5")


@pytest.mark.parametrize("suffix", sorted(FORMATS))
@pytest.mark.parametrize("read", [read_table, read_metadata])
def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path, suffix: str, read: Callable[[Path], object]) -> None:
    path = tmp_path / f"pipe{suffix}"
    os.mkfifo(path)
    with pytest.raises(RecordingError, match="expected a readable file, got: a pipe, not a regular file"):
        read(path)


STUB = """
import os, sys, time
sys.stdin.buffer.read(1)
{act}
"""


@pytest.mark.parametrize(
    ("act", "said"),
    [
        ("time.sleep(100)", "got one that is not: it is damaged, or made to keep a program busy"),
        campaign(("os.abort()", r"got one that ends its reader \(status -6\)")),
        campaign(("sys.exit(3)", r"got one that ends its reader \(status 3\)")),
        ("sys.stdout.write('no answer' * 9); sys.stdout.flush(); os._exit(0)", "got one that ends its reader"),
    ],
)
def test_a_reader_that_does_not_answer_is_ended_and_the_next_file_is_read(
    tmp_path: Path, own_table: Table, monkeypatch: pytest.MonkeyPatch, act: str, said: str
) -> None:
    path = tmp_path / "run.h5"
    write_table(own_table, path)
    (tmp_path / "stub_reader.py").write_text(STUB.format(act=act))
    reader = Reader()
    with monkeypatch.context() as patch:
        patch.setenv("PYTHONPATH", str(tmp_path))
        patch.setattr(apart, "PROCESS", "stub_reader")
        if "sleep" in act:
            patch.setattr(apart, "WAITING", 0.05)
        with pytest.raises(RecordingError, match=rf"run\.h5: .*{said}"):
            reader.table(path, Request())
    try:
        assert reader.table(path, Request()).n_rows == own_table.n_rows
    finally:
        reader.end()


@pytest.mark.parametrize("suffix", [suffix for suffix, form in FORMATS.items() if form.write and form.is_sandboxed])
def test_every_kind_of_column_comes_through(tmp_path: Path, suffix: str) -> None:
    columns = {
        "x": np.array([0.0, -0.0, np.nan]),
        "n": np.array([1, -2, 1 << 62]),
        "b": np.array([True, False, True]),
        "t": as_text(["", "ä\u2028", "1"]),
    }
    path = tmp_path / f"run{suffix}"
    write_table(Table(path, columns, {"x": "Nm"}, {"who": "me"}), path)
    read = read_table(path)
    for name, column in columns.items():
        assert read.columns[name].dtype == column.dtype
        np.testing.assert_array_equal(read.columns[name], column)
    assert read.units["x"] == "Nm"
    assert read_metadata(path)["who"] == "me"


def test_the_limits_are_set_where_it_reads() -> None:
    shown = (f"print(resource.getrlimit(resource.{name})[0])" for name in ("RLIMIT_CORE", "RLIMIT_CPU", "RLIMIT_AS"))
    program = "\n".join(
        [
            "import resource",
            "from hil.recording.bounds import memory_bytes, processor_s",
            "from hil.recording.sandbox import limit",
            "limit(memory_bytes(0), processor_s(0))",
            *shown,
        ]
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", program],
        env={**os.environ, **ENVIRONMENT},
        capture_output=True,
        text=True,
        check=True,
    )
    core, cpu_s, space = map(int, done.stdout.split())
    assert core == 0
    assert 10 <= cpu_s <= 60
    assert MEMORY_BYTES < space < MEMORY_BYTES + GIB
    assert resource.getrlimit(resource.RLIMIT_AS)[0] != space
