"""Oddities of makers' data sheets: what changes nothing is no hindrance, and what does is said with its line."""

import re
from pathlib import Path

import pytest

from drivers.datasheet.file import Commissioning, read_commissioning
from drivers.datasheet.text import Severity, read_eds_text
from drivers.eds_check import check_eds
from tests.chosen import one_in
from tests.drivers.maker_files import COMPLETE, EPOS_DCF, FIXED, I8, I16, U8, U16, U32, Entry, Maker, fixed, pdo, pdos
from tests.drivers.maker_rig import drive

SHORT = 20


def without_sections(pattern: str) -> Maker:
    return COMPLETE.but(habit=lambda text: re.sub(rf"(?ms)^\[({pattern})\]\n.*?(?=^\[)", "", text))


FOR_GOOD = {0: Entry(U8, "ro", "2"), 1: Entry(U32, "const", "$NODEID+0x200"), 2: Entry(U8, default="255")}
"""Communication parameter whose identifier can't be written, as in Elmo SimplIQ drives."""

USABLE = {
    "spaces in formulas": COMPLETE.but(habit=lambda text: text.replace("$NODEID+", "$NODEID + ")),
    "commands that can only be written": COMPLETE.having(
        {index: Entry(kind, "wo", "", 1) for index, kind in {0x6040: U16, 0x6060: I8, 0x6071: I16, 0x60B2: I16}.items()}
    ),
    "heartbeat consumer that can't be read back": COMPLETE.having(
        {0x1016: {0: Entry(U8, "ro", "1"), 1: Entry(U32, "wo")}}
    ).but(lines=("accepted.heartbeat_consumer", "accepted.rpdo_deadline")),
    "max torque left free": COMPLETE.having({0x6072: Entry(U16, "rww", "0", 1)}),
    "SYNC left blank": COMPLETE.having({0x1005: Entry(U32)}),
    "no device type and error register": COMPLETE.but(0x1000, 0x1001),
    "no sub-index 0": without_sections("1018sub0|140[01]sub0|180[01]sub0"),
    "mapped, and PDOMapping is 0": FIXED.but(habit=lambda text: text.replace("PDOMapping=1", "PDOMapping=0")),
    "default beyond its limit": COMPLETE.but(
        habit=lambda text: text.replace("DefaultValue=1000\n", "DefaultValue=1000\nHighLimit=9\n")
    ),
    "few mapping entries listed": COMPLETE.having(
        {
            **pdos(0x1400, pdo("$NODEID+0x200", "255", room=1), pdo("$NODEID+0x300", "255", room=2)),
            **pdos(0x1800, pdo("$NODEID+0x180", "255", room=1), pdo("$NODEID+0x280", "255", room=2)),
        }
    ),
    "identifiers of 29 bits, all the same": COMPLETE.having(
        {**pdos(0x1400, pdo("0x20000201", "255")), **pdos(0x1800, pdo("0x20000201", "255"))}
    ).but(0x1401, 0x1601, 0x1801, 0x1A01),
    "identifiers for good, and a blank mapping": COMPLETE.having(
        {
            0x1400: FOR_GOOD,
            0x1800: FOR_GOOD | {1: Entry(U32, "ro", "$NODEID+0x40000180")},
            0x1A00: {n: Entry(U32 if n else U8) for n in range(9)},
        }
    ),
    "no identifier, by the node id": COMPLETE.having(
        {**pdos(0x1400, pdo("$NODEID+0x80000000", "255")), **pdos(0x1800, pdo("$NODEID+0x80000000", "255"))}
    ),
}

REFUSED = {
    "identifier of another node for good": (
        COMPLETE.having({0x1400: FOR_GOOD | {1: Entry(U32, "const", "0x201")}}).but(0x1401, 0x1601),
        "0x1400:01 can not be written and has not COB-ID 0x27F",
    ),
    "fixed command with a speed": (
        COMPLETE.having({0x1600: fixed("0x60400010", "0x60710010", "0x60FF0020")}).but(0x1401, 0x1601),
        "one RPDO or several that map 0x6040, 0x6071",
    ),
    "mapping that can't be read": (
        COMPLETE.but(0x1801, 0x1A01).having({0x1A00: {n: Entry(U32 if n else U8, "wo") for n in range(9)}}),
        "one TPDO or several",
    ),
    "65 mapped objects": (
        COMPLETE.but(0x1801, 0x1A01).having({0x1A00: {0: Entry(U8, "const", "65"), 1: Entry(U32, "const")}}),
        "0x1A00:00 is 65: not allowed, at most 64",
    ),
}


def written(maker: Maker, folder: Path) -> Path:
    path = folder / f"drive{maker.suffix}"
    path.write_text(maker.text(), encoding="latin-1")
    return path


@pytest.mark.parametrize("name", one_in(3, USABLE))
def test_what_changes_nothing_is_no_hindrance(name: str, tmp_path: Path) -> None:
    path = written(USABLE[name], tmp_path)
    report = check_eds(path)
    assert report.usable, [str(each) for each in report.findings if each.severity is Severity.ERROR]
    assert tuple(line.key for line in report.lines) == USABLE[name].lines
    driven = drive(path, tmp_path, SHORT)
    assert (driven.recorded, driven.flagged, driven.before, driven.after) == (SHORT, 0, (), ())


@pytest.mark.parametrize("name", REFUSED)
def test_what_does_is_said_with_its_line(name: str, tmp_path: Path) -> None:
    maker, said = REFUSED[name]
    errors = [each for each in check_eds(written(maker, tmp_path)).findings if each.severity is Severity.ERROR]
    assert any(said in str(each) and each.line is not None for each in errors), [str(each) for each in errors]


@pytest.mark.parametrize(
    ("node", "rate", "read"),
    [
        ("0x7F", "0xFA", Commissioning(127, 250, "front")),
        ("0", "1000", Commissioning(None, 1000, "front")),
        ("128", "250000", Commissioning(None, None, "front")),
        ("", "250 kbit", Commissioning(None, None, "front")),
    ],
)
def test_commissioning_that_can_not_be_is_left_out_and_reported(
    node: str, rate: str, read: Commissioning, tmp_path: Path
) -> None:
    text = EPOS_DCF.text().replace("NodeID=1", f"NodeID={node}").replace("Baudrate=250", f"Baudrate={rate}")
    path = tmp_path / "drive.dcf"
    path.write_text(text)
    assert read_commissioning(read_eds_text(path)) == read
    reported = [each.place for each in check_eds(path).findings if each.place.startswith("[DeviceComissioning]")]
    wrong = [("NodeID", node and read.node_id is None), ("Baudrate", read.bit_rate_kbit_s is None)]
    assert reported == [f"[DeviceComissioning] {key}" for key, is_wrong in wrong if is_wrong]
