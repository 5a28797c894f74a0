"""Each rule of the EDS checker: the shipped file with one fault, found with its line, and nothing else found."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from drivers.datasheet.text import Severity
from tests.drivers.eds_bench import E, N, W, checked, edited, line_of

MORE = 20
"""Lines put before the file, so that a line number counted from a section would be noticed."""


@dataclass(frozen=True)
class Fault:
    """One text replaced in one section, and the one finding it must give."""

    section: str
    old: str
    new: str
    severity: Severity
    key: str
    expected: str
    found: str


EDITS = [
    # sections
    Fault("DeviceInfo", "Granularity=8", "Granularity=0", W, "Granularity", "8, so that", "no mapping, '0'"),
    # entries
    Fault("1018sub3", "DataType=0x0007", "DataType=0x0017", E, "DataType", "a data type of CiA 301", "'0x0017'"),
    Fault("6077", "AccessType=ro", "AccessType=r", E, "AccessType", "one of ro, wo, rw", "'r'"),
    Fault(
        "6040", "DataType=0x0006", "DataType=0x0003", E, "DataType", "0x0006 (UNSIGNED16) for controlword", "'0x0003'"
    ),
    # values
    Fault("6072", "DefaultValue=1000", "DefaultValue=1000.0", E, "DefaultValue", "UNSIGNED16, 0 to 65535", "'1000.0'"),
    Fault(
        "6072",
        "DefaultValue=1000",
        "DefaultValue=01000",
        W,
        "DefaultValue",
        "without a leading 0",
        "octal, 512: '01000'",
    ),
    Fault(
        "6072",
        "DefaultValue=1000",
        "DefaultValue=0900",
        E,
        "DefaultValue",
        "without a leading 0",
        "no octal number '0900'",
    ),
    # PDOs
    Fault("1400sub1", "$NODEID+0x200", "0x20000200", W, "DefaultValue", "11 bits", "'0x20000200'"),
    Fault(
        "1400sub1",
        "$NODEID+0x200",
        "$NODEID+0x600",
        W,
        "DefaultValue",
        "an identifier a PDO may have",
        "0x67F for node 127",
    ),
    Fault("1400sub1", "$NODEID+0x200", "0x80", W, "DefaultValue", "an identifier a PDO may have", "0x080 for node 127"),
    Fault("1400sub1", "$NODEID+0x200", "0x205", W, "DefaultValue", "$NODEID+0x200, for this is a constant", "'0x205'"),
    Fault("1800sub1", "$NODEID+0x180", "0x3C0", W, "DefaultValue", "$NODEID+0x180, for this is a constant", "'0x3C0'"),
    Fault(
        "1800sub1",
        "$NODEID+0x180",
        "$NODEID+0x200",
        E,
        "DefaultValue",
        "another identifier than 0x1400",
        "'$NODEID+0x200'",
    ),
    Fault("1A00sub2", "0x60770010", "0x60770008", W, "DefaultValue", "16 bit for 0x6077:00 (INTEGER16", "8 bit in"),
    Fault(
        "6077", "PDOMapping=1", "PDOMapping=0", W, "[1A00sub2] DefaultValue", "PDOMapping=1; 0x6077:00", "'0x60770010'"
    ),
    Fault("6071", "AccessType=rw", "AccessType=rwr", W, "[1600sub2] DefaultValue", "a RPDO may carry", "'0x60710010'"),
    # needs
    Fault("1000", "0x00020192", "0x00020191", W, "DefaultValue", "profile 402", "401 in '0x00020191'"),
    Fault(
        "1017",
        "AccessType=rw",
        "AccessType=ro",
        E,
        "AccessType",
        "can be written and read for producer heartbeat time 0x1017:00",
        "'ro'",
    ),
    Fault(
        "6061",
        "AccessType=ro",
        "AccessType=wo",
        E,
        "AccessType",
        "can be read for modes of operation display 0x6061:00",
        "'wo'",
    ),
    Fault("60A9", "DefaultValue=0xFDB44700", "DefaultValue=", W, "DefaultValue", "a unit of angle per time", "none"),
    Fault("60A9", "0xFDB44700", "0xFD014700", W, "DefaultValue", "a unit of angle per time", "'0xFD014700'"),
    Fault("6007", "DefaultValue=2", "DefaultValue=0", W, "DefaultValue", "there shall be no torque", "no action, '0'"),
    Fault("1005", "0x00000080", "0x00000081", W, "DefaultValue", "the host sends SYNC with 0x080", "'0x00000081'"),
    Fault("1005", "0x00000080", "0x40000080", W, "DefaultValue", "the drive does not", "'0x40000080'"),
    Fault("1014", "$NODEID+0x80", "$NODEID+0x100", W, "DefaultValue", "$NODEID+0x80", "'$NODEID+0x100'"),
    Fault("1800sub2", "DefaultValue=1", "DefaultValue=255", W, "DefaultValue", "1, at every SYNC", "'255'"),
    Fault("1800sub2", "DefaultValue=1", "DefaultValue=2", W, "DefaultValue", "1, at every SYNC", "'2'"),
    Fault("1400sub2", "DefaultValue=1", "DefaultValue=255", W, "DefaultValue", "1, at every SYNC", "'255'"),
    Fault("1600sub1", "AccessType=rw", "AccessType=ro", N, "AccessType", "0x1600:01 that can be written", "'ro'"),
    Fault(
        "1400sub1",
        "$NODEID+0x200",
        "$NODEID+0x80000200",
        W,
        "DefaultValue",
        "a PDO that is switched on",
        "one switched off",
    ),
]


def _id(each: object) -> str:
    return (
        f"{each.section} {each.new.strip() or 'without ' + each.old.strip()}" if isinstance(each, Fault) else str(each)
    )


@pytest.mark.parametrize("fault", EDITS, ids=_id)
def test_one_fault_is_one_finding_with_its_line(tmp_path: Path, fault: Fault) -> None:
    text = ";\n" * MORE + edited(fault.section, fault.old, fault.new)
    report = checked(tmp_path, text)
    (finding,) = (each for each in report.findings if not each.advice.startswith("A run maps it"))
    assert finding.severity is fault.severity
    assert report.usable is (fault.severity is not Severity.ERROR)
    section, _, key = fault.key.rpartition(" ")
    section = section.strip("[]") or fault.section
    assert finding.place == f"[{section}] {key}".strip()
    assert fault.expected in finding.expected
    assert fault.found in finding.found
    there = key and any(
        line.startswith(f"{key}=") for line in text.split(f"[{section}]\n")[1].split("\n[")[0].split("\n")
    )
    assert finding.line == line_of(text, section, key if there else "")
    assert finding.advice.endswith(".")
