"""``hil check``: what a person and a script read of it."""

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from drivers.inverter.cia402 import TorqueMode
from drivers.resources import data_file
from hil.cli.main import run
from hil.config.rig_file import read_rig
from hil.simulator import rig_server
from hil.simulator.drive_physics import SimulatedInverter
from hil.simulator.faults import AtStep, InverterFaults, PlcFaults, RigFaults
from tests.rig.serving import served


@contextmanager
def rig_with(faults: RigFaults, path: Path) -> Iterator[tuple[str, ...]]:
    with served(read_rig(path), faults) as (server, _):
        yield ("check", str(path), "--bus", server.bus_url, "--modbus", str(server.modbus))


def test_complete_rig(short_rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with rig_with(RigFaults(), short_rig) as command:
        assert run(command) == 0
    printed = capsys.readouterr()
    assert printed.out.count("agrees") == 4
    assert printed.err == ""


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_registers_of_the_plc_are_shown_and_one_that_can_not_be_is_refused(
    short_rig: Path, options: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    with rig_with(RigFaults(plc=PlcFaults(swaps_floats=True)), short_rig) as command:
        assert run([*command, *options]) == 3
    printed = capsys.readouterr()
    assert "plc" in printed.err
    if options:
        plc = json.loads(printed.out)["devices"][3]
        held = {each["name"]: each for each in plc["registers"]}
        assert (held["torque_limit"]["value"], held["torque_limit"]["unit"]) == (pytest.approx(400.0), "Nm")
        assert held["torque_limit"]["problem"] is None
        assert "'high_word_first'" in held["speed_limit"]["problem"]
    else:
        rows = {row.split()[1]: row for row in printed.out.splitlines() if "│" in row and len(row.split()) > 1}
        assert "400" in rows["torque_limit"]
        assert "Nm" in rows["torque_limit"]
        assert "not plausible" in rows["speed_limit"]


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_drive_in_fault_is_noted(short_rig: Path, options: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    with rig_with(RigFaults(m1=InverterFaults(fault=AtStep(0, 0x2310))), short_rig) as command:
        assert run([*command, *options]) == 0
    printed = capsys.readouterr().out
    notes = json.loads(printed)["devices"][1]["notes"] if options else [" ".join(printed.split())]
    assert len(notes) == 1
    assert "power state is fault, error code 0x603F is 0x2310 continuous over-current, motor side" in notes[0]
    assert "Fix the cause at the drive, reset the fault." in notes[0]


SHIPPED = str(data_file("inverter.eds"))


@pytest.fixture
def faulty(tmp_path: Path) -> Path:
    path = tmp_path / "faulty.eds"
    text = Path(SHIPPED).read_text().replace("DefaultValue=0xFDB44700", "DefaultValue=fast")
    path.write_text(text.replace("Granularity=8", "Granularity=0"))
    return path


def test_error_is_reported_with_its_line(faulty: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "--eds", str(faulty)]) == 2
    printed = capsys.readouterr()
    line = faulty.read_text().split("\n").index("DefaultValue=fast") + 1
    assert f"{faulty}:{line}: error: [60A9] DefaultValue: expected a number of UNSIGNED32" in printed.out
    assert f"error: EDS {faulty} is not usable: 1 error, 2 warnings: see above." in printed.err


def test_json(faulty: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "--eds", SHIPPED, "--eds", str(faulty), "--json"]) == 2
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "hil.eds_check/1"
    assert [(file["file"], file["usable"]) for file in document["files"]] == [(SHIPPED, True), (str(faulty), False)]
    first = document["files"][1]["findings"][0]
    assert first == {
        "severity": "warning",
        "line": 31,
        "place": "[DeviceInfo] Granularity",
        "expected": "8, so that objects can be mapped byte by byte",
        "found": "no mapping, '0'",
        "advice": "If the drive's mapping is fixed, configuring it will be refused; ask its maker.",
    }


@pytest.mark.parametrize("content", [b"", b"\x00\x01\x02", "[DeviceInfo]".encode("utf-16"), b"[can]\n"])
def test_file_that_is_no_eds(tmp_path: Path, content: bytes, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "no.eds"
    path.write_bytes(content)
    assert run(["check", "--eds", str(path)]) == 2
    assert capsys.readouterr().out.startswith(f"{path}: error: file: expected ")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "expected a rig file, an EDS with --eds, or both"),
        (["--eds", SHIPPED, "--bus", "virtual:x"], "expected a rig file next to them"),
        (["--eds", SHIPPED, "--prove-stop"], "expected a rig file next to them"),
    ],
)
def test_arguments_that_make_no_sense(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", *arguments]) == 2
    assert said in capsys.readouterr().err


Edits = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Mismatch:
    """What is planted in m1 (or the PLC), and what ``hil check`` must say of it.

    ``device`` and ``host`` are changes of the text of a file: regular expression and replacement, each to match
    once. They are made to the EDS, unless they begin with the name of another file.
    """

    name: str
    expected: str
    found: str
    device: Edits = ()
    host: Edits = ()
    faults: InverterFaults = field(default_factory=InverterFaults)
    modes: frozenset[TorqueMode] = frozenset(TorqueMode)


def eds_default(section: str, value: str) -> tuple[str, str]:
    return (rf"(?s)(\[{section}\]\n(?:(?!\[).)*?DefaultValue=)[^\n]*", rf"\g<1>{value}")


def rig_key(key: str, value: str) -> tuple[str, str]:
    """Change a key of ``[inverters.m1]``."""
    return (rf"rig: (?s)(\[inverters\.m1\]\n(?:(?!\n\[).)*?{key} = )\S+", rf"\g<1>{value}")


DIFFERENCES = [
    Mismatch("vendor-ID 0x1018:01", "0x000003E7", "0x0000FFFE", faults=InverterFaults(identity=(0xFFFE, 0x402))),
    Mismatch("product code 0x1018:02", "0x00000402", "0x00000403", faults=InverterFaults(identity=(0x3E7, 0x403))),
    Mismatch("product code 0x1018:02", "0x00000501", "0x00000402", host=(rig_key("product_code", "0x501"),)),
    Mismatch(
        "serial number 0x1018:04",
        "7",
        "1: another drive has this",
        host=((r"rig: # serial_number = .*", "serial_number = 7"),),
    ),
    Mismatch("motor rated torque 0x6076", "600 Nm", "450 Nm", device=(rig_key("rated_torque_nm", "450.0"),)),
    Mismatch(
        "max torque 0x6072", "at least the torque limit of 400 Nm", "300 Nm", device=(eds_default("6072", "500"),)
    ),
    Mismatch("SI unit velocity 0x60A9", "0xFDB44700", "0x00B44700", faults=InverterFaults(velocity_unit=0x00B44700)),
    Mismatch(
        "supported drive modes 0x6502",
        "mode 10 (cyclic synchronous torque) among them",
        "0x00000008 with 4 (profile torque)",
        modes=frozenset({TorqueMode.PROFILE_TORQUE}),
    ),
    Mismatch(
        "PDO 0x1800/0x1A00",
        "maps 0x6041:00 (16 bit), 0x6077:00 (16 bit), 0x606C:00 (32 bit)",
        "maps 0x6041:00 (16 bit), 0x6078:00 (16 bit), 0x606C:00 (32 bit)",
        device=(eds_default("1A00sub2", "0x60780010"),),
    ),
    Mismatch(
        "PDO 0x1800/0x1A00", "transmission type 1,", "transmission type 4,", device=(eds_default("1800sub2", "4"),)
    ),
    Mismatch("PDO 0x1400/0x1600", "COB-ID 0x201,", "COB-ID 0x301,", device=(eds_default("1400sub1", "$NODEID+0x300"),)),
    Mismatch(
        "PDO 0x1400/0x1600",
        "COB-ID 0x201, ",
        "COB-ID 0x201 (switched off), ",
        device=(eds_default("1400sub1", "$NODEID+0x80000200"),),
    ),
    Mismatch("COB-ID SYNC 0x1005:00", "128", "129", device=(eds_default("1005", "0x81"),)),
    Mismatch("abort connection option code 0x6007:00", "1 (fault), 2", "0, no", device=(eds_default("6007", "0"),)),
    Mismatch(
        "quick stop option code 0x605A:00",
        "5",
        "2",
        device=(eds_default("605A", "2"),),
        host=((r"rig: # option_codes = .*", "option_codes = { quick_stop = 5 }"),),
    ),
]


def _name(each: object) -> str:
    return f"{each.name}: {each.found}" if isinstance(each, Mismatch) else str(each)


def written(folder: Path, edits: Edits) -> Path:
    """Write rig file, EDS of m1 and register map with changes; the path of the rig file."""
    folder.mkdir()
    texts = {
        "rig": Path("examples/rig.toml").read_text(),
        "eds": data_file("inverter.eds").read_text(),
        "map": data_file("plc.toml").read_text(),
    }
    texts["rig"] = texts["rig"].replace('# eds = "inverter.eds"', 'eds = "m1.eds"').replace('# map = "', 'map = "')
    for pattern, value in edits:
        kind, colon, rest = pattern.partition(": ")
        kind, pattern = (kind, rest) if colon else ("eds", pattern)
        texts[kind], times = re.subn(pattern, value, texts[kind])
        assert times == 1, f"{pattern} is {times} times in {kind}"
    (folder / "m1.eds").write_text(texts["eds"])
    (folder / "plc.toml").write_text(texts["map"])
    (folder / "rig.toml").write_text(texts["rig"])
    return folder / "rig.toml"


@contextmanager
def planted(tmp_path: Path, each: Mismatch, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """Serve the rig with the mismatch; yields the command line that checks it."""

    def with_modes(*arguments: object) -> SimulatedInverter:
        made: SimulatedInverter = original(*arguments)
        return replace(made, supported_modes=each.modes) if made.node_id == 1 else made

    original = rig_server._inverter
    monkeypatch.setattr(rig_server, "_inverter", with_modes)
    device = read_rig(written(tmp_path / "device", each.device))
    host = written(tmp_path / "host", each.host)
    with served(device, RigFaults(m1=each.faults)) as (server, _):
        yield ["check", str(host), "--bus", server.bus_url, "--modbus", str(server.modbus)]


@pytest.fixture(autouse=True)
def wide_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the table in one line per difference."""
    monkeypatch.setenv("COLUMNS", "500")


MAPPED = [each for each in DIFFERENCES if each.name.startswith("PDO")]
"""What a run maps anew, whatever the drive has: a remark, for `hil run` does not refuse it either."""


@pytest.mark.parametrize("each", [each for each in DIFFERENCES if each not in MAPPED], ids=_name)
def test_difference_of_an_inverter_is_named(
    each: Mismatch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with planted(tmp_path, each, monkeypatch) as command:
        assert run([*command, "--json"]) == 3
        document, reported = capsys.readouterr()
        assert run(command) == 3
        table = capsys.readouterr().out
    devices = {device["name"]: device for device in json.loads(document)["devices"]}
    differences = {difference["what"]: difference for difference in devices["m1"]["differences"]}
    assert list(differences) == [each.name], "one mismatch planted is one named"
    assert each.expected in differences[each.name]["expected"]
    assert each.found in differences[each.name]["found"]
    assert [name for name, device in devices.items() if device["result"] != "agrees"] == ["m1"]
    assert ": m1: expected all there and as described" in reported
    (row,) = (line for line in table.splitlines() if each.name in line)
    assert each.expected in row
    assert each.found in row


@pytest.mark.parametrize(
    ("each", "device", "said"),
    [
        (Mismatch("absent", "", "", faults=InverterFaults(absent=True)), "m1", "0x1018:01"),
        (Mismatch("hung", "", "", faults=InverterFaults(hang_at_step=0)), "m1", "0x1018:01"),
        (Mismatch("another node", "", "", host=(rig_key("node_id", "9"),)), "m1", "inverter m1 (node 9)"),
        (Mismatch("object", "", "", faults=InverterFaults(missing_objects=frozenset({0x60A9}))), "m1", "0x60A9:00"),
        (
            Mismatch("another PLC", "", "", host=(("map: device_code = 0x2024", "device_code = 0x2025"),)),
            "plc",
            "expected 8229",
        ),
    ],
    ids=lambda each: each.name if isinstance(each, Mismatch) else "",
)
def test_device_that_is_not_there_or_another_is_named(
    each: Mismatch,
    device: str,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    with planted(tmp_path, each, monkeypatch) as command:
        assert run(command) == 3
    printed = capsys.readouterr()
    assert f": {device}: expected all there and as described" in printed.err
    (note,) = (line for line in printed.out.splitlines() if line.startswith(f"{device}: "))
    assert said in note
