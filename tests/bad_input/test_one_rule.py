"""Files and processes of others go through one rule each; every place in the code that could go around it is listed."""

import ast
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drivers.datasheet.text import read_eds_text
from drivers.errors import DriverError
from drivers.foreign_file import open_regular, read_regular, read_regular_text
from drivers.plc.modbus_security import Credentials, client_context
from drivers.plc.register_map import load_register_map
from hil.errors import HilError, RigFileError
from hil.files import read_json
from hil.plants.fmu_process import unpack
from hil.problems import read_toml
from hil.provenance import Source
from hil.recording.bus_database import database_of
from hil.recording.formats import read_metadata, read_table
from hil.recording.look import look
from hil.rig.trace import _opened

ROOT = Path(__file__).parents[2]

READS = frozenset(
    "read_text read_bytes loadmat load_from_mat load_workbook ParquetFile read_schema open_csv BLFReader load_file "
    "load_cert_chain load_verify_locations copyfile File TdmsFile.open feather.read_table json.read_json "
    "ZipFile".split()
)
"""Calls that open a file by its name, besides ``open`` itself."""

NO_FILES = ("CanLink.open", "webbrowser.open", "h5o.open", "archive.open", "_inbox.open")

BEHIND_FORMAT = "the rule has opened it in hil.recording.formats.format_of"
OURS = "a file of this program"
MADE = "this program has just written it"
SYSTEM = "a file of the system"

AROUND_THE_FILES = {
    "drivers.canopen.emcy": OURS,
    "drivers.canopen.remote_bus.kept_token": "in a folder that nobody else can write to",
    "drivers.foreign_file.open_regular": "the rule",
    "drivers.plc.modbus_security._context": "the rule has looked at it in _load",
    "hil.cli.command_line.silence": "the null device, to write to",
    "hil.cli.completion.effect_names": OURS,
    "hil.config.new_rig.rig_text": OURS,
    "hil.export.fmu.package._headers": "a file of FMPy",
    "hil.export.fmu.package.own": OURS,
    "hil.export.fmu.ssp.augmented_ssp": MADE,
    "hil.export.structured_text.filled": OURS,
    "hil.figures.road._metadata": OURS,
    "hil.fleet.dataset._table": "what the rule has opened",
    "hil.plants.fmu_process.unpack": "what the rule has opened",
    "hil.proof.command.fresh_over_floor": MADE,
    "hil.proof.rigs.rig_text": OURS,
    "hil.proof.sealed_set._fresh": MADE,
    "hil.proof.truth.compiled._cache_folder": OURS,
    "hil.recording.array_formats.read_ods": BEHIND_FORMAT,
    "hil.recording.array_formats.read_xlsx": BEHIND_FORMAT,
    "hil.recording.bus_database.database_of": "the rule has looked at it a line before",
    "hil.recording.csv_format._is_recognised": MADE,
    "hil.recording.csv_format.read_packed": BEHIND_FORMAT,
    "hil.recording.hdf5_format.reading": BEHIND_FORMAT,
    "hil.recording.mat_format.read": BEHIND_FORMAT,
    "hil.recording.mat_format.with_tables": BEHIND_FORMAT,
    "hil.recording.measurement_formats.__iter__": BEHIND_FORMAT,
    "hil.recording.measurement_formats._tdms": BEHIND_FORMAT,
    "hil.recording.own_csv._blocks": BEHIND_FORMAT,
    "hil.recording.parquet_format.read": BEHIND_FORMAT,
    "hil.recording.parquet_format.read_feather": BEHIND_FORMAT,
    "hil.recording.parquet_format.read_json_lines": BEHIND_FORMAT,
    "hil.recording.parquet_format.read_metadata": BEHIND_FORMAT,
    "hil.recording.sandbox._address_space": SYSTEM,
    "hil.recording.wpilib_formats.data_log": BEHIND_FORMAT,
    "hil.recording.wpilib_formats.sysid": BEHIND_FORMAT,
    "hil.report.page.plotly_bundle": OURS,
    "hil.report.page._text": OURS,
    "hil.report.paper_page._figures": MADE,
    "hil.rig.realtime._has_capability": SYSTEM,
    "hil.version._commit": OURS,
}
"""Where a file is opened for reading by another way than the rule, and why that is right."""

AROUND_THE_PROCESSES = {
    "hil.child.start": "the rule",
    "hil.fleet.run._own_cluster": "Dask's own, with safe_path",
    "hil.monitor.live_estimation.__init__": "this program's own, with safe_path",
    "hil.monitor.source.__init__": "this program's own, with safe_path",
    "hil.version._git": "git, asked of this program's own checkout",
}


def places(is_meant: Callable[[ast.Call], bool]) -> dict[str, list[int]]:
    """Return the functions that make such a call, and in which lines."""
    found: dict[str, list[int]] = {}
    for path in sorted((*ROOT.glob("hil/**/*.py"), *ROOT.glob("drivers/**/*.py"))):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for name, node in walk(ast.parse(path.read_text(encoding="utf-8")), module):
            if isinstance(node, ast.Call) and is_meant(node):
                found.setdefault(name, []).append(node.lineno)
    return found


def walk(tree: ast.AST, module: str, name: str = "") -> Iterator[tuple[str, ast.AST]]:
    for node in ast.iter_child_nodes(tree):
        inside = f"{module}.{node.name}" if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) else name
        yield inside or module, node
        yield from walk(node, module, inside)


def called(node: ast.Call) -> tuple[str, str]:
    """Return what a call is of: a name, and with what it is reached by."""
    function = node.func
    if isinstance(function, ast.Attribute):
        return function.attr, f"{getattr(function.value, 'attr', getattr(function.value, 'id', ''))}.{function.attr}"
    name = getattr(function, "id", "")
    return name, name


def opens_to_read(node: ast.Call) -> bool:
    name, whole = called(node)
    if whole == "os.open":
        return not any(isinstance(each, ast.Attribute) and each.attr == "O_WRONLY" for each in ast.walk(node))
    if name == "open" and whole not in NO_FILES:
        given = [*node.args[whole == "open" :], *(each.value for each in node.keywords if each.arg == "mode")]
        texts = [each.value for each in given if isinstance(each, ast.Constant) and isinstance(each.value, str)]
        return whole == "open" or (bool(node.args or node.keywords) and not set("".join(texts)) & set("wxa+"))
    is_written = any(isinstance(each, ast.Constant) and each.value == "w" for each in node.args)
    return not is_written and (name in READS or whole in READS)


def starts_a_process(node: ast.Call) -> bool:
    name, whole = called(node)
    return name in ("Popen", "Process", "LocalCluster", "system", "fork", "posix_spawn") or whole.startswith(
        "subprocess."
    )


def test_every_file_is_opened_by_the_rule_or_said_why_not() -> None:
    assert {name: lines for name, lines in places(opens_to_read).items() if name not in AROUND_THE_FILES} == {}


def test_every_process_is_started_by_the_rule_or_said_why_not() -> None:
    assert {n: lines for n, lines in places(starts_a_process).items() if n not in AROUND_THE_PROCESSES} == {}


def test_no_place_is_listed_that_is_gone() -> None:
    assert set(AROUND_THE_FILES) - set(places(opens_to_read)) == set()
    assert set(AROUND_THE_PROCESSES) - set(places(starts_a_process)) == set()


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def folder(path: Path) -> None:
    path.mkdir()


READERS: dict[str, Callable[[Path], object]] = {
    "open_regular": open_regular,
    "read_regular": read_regular,
    "read_regular_text": read_regular_text,
    "json": read_json,
    "toml": lambda path: read_toml(path, RigFileError),
    "register map": load_register_map,
    "data sheet": read_eds_text,
    "checksum": Source.of,
    "fmu": lambda path: unpack(path, path.parent / "home"),
    "dbc": lambda path: database_of(path, path),
    "trace": _opened,
    "certificate": lambda path: client_context(Credentials(path, path, path)),
    "recording": read_table,
    "metadata": read_metadata,
    "look": look,
}


@pytest.mark.parametrize("make", [os.mkfifo, device, folder])
@pytest.mark.parametrize("kind", READERS)
def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path, kind: str, make: Callable[[Path], None]) -> None:
    path = tmp_path / ("x.dbc" if kind == "dbc" else "x.csv")
    make(path)
    with pytest.raises((OSError, HilError, DriverError), match=r"a pipe|a device|[Ii]s a directory"):
        READERS[kind](path)


def test_no_more_is_read_than_may_be_or_than_there_is(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(bytes(1 << 20) + b"x")
    assert len(read_regular(path, (1 << 20) + 1)) == (1 << 20) + 1
    with pytest.raises(OSError, match="more than 1 MB"):
        read_regular(path, 1 << 20)
    assert read_regular(Path("/proc/self/status")) == b""  # its size is 0, whatever comes out of it
