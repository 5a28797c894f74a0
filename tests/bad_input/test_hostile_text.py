"""TOML, JSON and traces that no person wrote: refused by file and place, whichever command reads them."""

import struct
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import can
import numpy as np
import pytest

from drivers.datasheet.types import octal_matters, read_formula, read_number
from drivers.eds_check.check import check_eds
from drivers.plc.register_map import RegisterMapError, load_register_map
from drivers.resources import data_file
from hil.cli.main import run
from hil.errors import RecordingError, RigFileError
from hil.files import parse_json
from hil.problems import read_toml
from hil.recording import Table, read_table, write_table
from hil.recording.description import sidecar_of
from hil.rig.trace import CONTAINER_BYTES, read_frames

DEEP = 3000

HOSTILE = {
    "nested lists": f"x = {'[' * DEEP}{']' * DEEP}",
    "nested tables": f"x = {'{a=' * DEEP}1{'}' * DEEP}",
    "dotted": ".".join("a" * DEEP) + " = 1",
    "long whole number": "x = " + "9" * 5000,
    "whole number beyond a float": "x = " + "9" * 400,
    "hexadecimal": "x = 0x" + "f" * 6000,
    "below 64 bit": f"x = {-(1 << 63) - 1}",
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_toml_that_no_person_wrote_is_refused_by_every_reader(
    tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "file.toml"
    path.write_text(text)
    with pytest.raises(RigFileError, match=r"file\.toml: .* \| expected .* \| got"):
        read_toml(path, RigFileError)
    for line in (
        f"check {path}",
        f"compare {path} a.csv",
        f"run {path} x --dry-run",
        f"commission {path} --out {tmp_path}/o",
    ):
        assert run(line.split()) == 2
        assert "file.toml" in capsys.readouterr().err
    with pytest.raises(RegisterMapError):
        load_register_map(path)


@pytest.mark.parametrize("kind", ["folder", "device", "large"])
def test_what_is_no_file_of_a_person_is_refused_and_not_read_to_its_end(tmp_path: Path, kind: str) -> None:
    path = Path("/dev/zero") if kind == "device" else tmp_path / "file.toml"
    if kind == "folder":
        path.mkdir()
    elif kind == "large":
        path.write_bytes(b"# comment\n" * (2 << 20))
    with pytest.raises(RigFileError, match="expected a readable TOML file"):
        read_toml(path, RigFileError)


JSON = {
    "nested": "[" * DEEP + "]" * DEEP,
    "nested objects": '{"a":' * DEEP,
    "long": '{"a": ' + "9" * 5000 + "}",
    "beyond a float": '{"a": ' + "9" * 400 + "}",
    "beyond 64 bit": '{"a": ' + str(1 << 63) + "}",
}


@pytest.mark.parametrize("text", JSON.values(), ids=JSON)
def test_json_that_no_person_wrote_is_refused_by_every_reader(
    tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ValueError, match=r"too deep|digits|Expecting|delimiter"):
        parse_json(text)
    recording = tmp_path / "run.csv"
    write_table(Table(recording, {"x": np.arange(3.0)}, {"x": "s"}), recording)
    sidecar_of(recording).write_text(text)
    with pytest.raises(RecordingError, match=r"run\.csv\.json"):
        read_table(recording)
    (tmp_path / "identification.json").write_text(text)
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "commitments.json").write_text(text)
    for line in (
        f"replay {recording} --filter {tmp_path}/identification.json",
        f"export st --model {tmp_path}/identification.json --out {tmp_path}/x.st",
        f"prove run {tmp_path}",
    ):
        assert run(line.split()) == 2
        capsys.readouterr()


def log(path: Path, *times: str) -> Path:
    path.write_text("".join(f"({time}) can0 080#\n" for time in times))
    return path


@pytest.mark.parametrize("time", ["inf", "-inf", "nan", "1e300", "1e18", "9" * 400])
def test_a_trace_with_a_time_of_no_clock_is_refused(tmp_path: Path, time: str) -> None:
    with pytest.raises(RecordingError, match=r"made\.log: expected"):
        list(read_frames(log(tmp_path / "made.log", "1.0", time)))


def container(data: bytes, size: int | None = None, method: int = 2) -> bytes:
    packed = zlib.compress(data, 9) if method == 2 else data
    body = struct.pack("<H6xL4x", method, len(data)) + packed
    head = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 16 + len(body) if size is None else size, 10)
    return head + body + bytes((16 + len(body)) % 4)


@pytest.fixture
def blf(tmp_path: Path) -> Callable[[bytes], Path]:
    path = tmp_path / "made.blf"
    with can.Logger(path) as logger:
        logger(can.Message(timestamp=1.0, arbitration_id=0x80, is_extended_id=False))
    head = path.read_bytes()[:144]

    def write(content: bytes) -> Path:
        path.write_bytes(head + content)
        return path

    return write


def objects(count: int) -> bytes:
    """Objects of a kind nobody knows, 32 bytes each."""
    return struct.pack("<4sHHLL", b"LOBJ", 16, 1, 32, 99).ljust(32, b"\0") * count


BAD_BLF = {
    "one container of gigabytes": lambda: container(bytes(4 * CONTAINER_BYTES)),
    "many containers": lambda: container(objects(CONTAINER_BYTES // 64)) * 40,
    "an object of length 0": lambda: container(struct.pack("<4sHHLL", b"LOBJ", 16, 9, 0, 1).ljust(64, b"\0")),
    "an object shorter than its header": lambda: container(
        struct.pack("<4sHHLL", b"LOBJ", 16, 9, 8, 1).ljust(64, b"\0")
    ),
    "a container of length 0": lambda: container(objects(1), size=0),
    "a method nobody knows": lambda: container(objects(1), method=7),
}


SLOW = ("many containers",)
"""Half a minute under a trace of the memory."""


@pytest.mark.parametrize(
    "make",
    [pytest.param(make, id=name, marks=[pytest.mark.campaign] * (name in SLOW)) for name, make in BAD_BLF.items()],
)
def test_a_blf_that_unpacks_to_much_or_never_ends_is_refused(
    blf: Callable[[bytes], Path], make: Callable[[], bytes]
) -> None:
    path = blf(make())
    assert path.stat().st_size < 1 << 20
    tracemalloc.start()
    with pytest.raises(RecordingError, match=r"made\.blf: expected a bus trace"):
        list(read_frames(path))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 128 << 20


@pytest.mark.parametrize("text", ["9" * 5000, "0" + "7" * 5000, "0x" + "f" * 5000, "-" + "1" * 5000])
def test_a_number_of_thousands_of_digits_is_none(text: str) -> None:
    assert read_number(text) is None
    assert read_formula(f"$NODEID+{text}") is None
    assert octal_matters(text) is False


def test_a_list_with_keys_of_thousands_of_digits_and_a_million_entries_is_checked(tmp_path: Path) -> None:
    entries = "\n".join(f"{n}=0x2000" for n in range(1, 100_000, 2))
    text = data_file("inverter.eds").read_text("utf-8")
    text += f"\n[ManufacturerObjects]\nSupportedObjects=1600000000\n{'9' * 5000}=0x2000\n{entries}\n"
    (tmp_path / "x.eds").write_text(text, "utf-8")
    assert check_eds(tmp_path / "x.eds").findings
