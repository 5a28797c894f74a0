"""What the EDS checker says of a whole file, where one fault has consequences or is reported once for many places."""

import re
from pathlib import Path

import pytest

from drivers.capability.table import TABLE, Function, Without
from drivers.datasheet.text import Severity
from drivers.eds_check import EdsReport
from tests.docs.pages import DOCS
from tests.drivers.eds_bench import SHIPPED, E, N, W, checked, edited, line_of, without


def places(report: EdsReport, severity: Severity) -> list[str]:
    return [finding.place for finding in report.findings if finding.severity is severity]


@pytest.mark.parametrize(
    ("section", "severity"),
    [("FileInfo", W), ("DeviceInfo", E), ("MandatoryObjects", W), ("OptionalObjects", W), ("ManufacturerObjects", W)],
)
def test_missing_section_is_named(tmp_path: Path, section: str, severity: Severity) -> None:
    report = checked(tmp_path, without(section))
    (finding,) = (each for each in report.findings if each.place == f"[{section}]")
    assert (finding.severity, finding.line) == (severity, None)
    assert report.usable is (severity is W)


NEEDED = [row.function for row in TABLE.values() if row.without is Without.REFUSED]


@pytest.mark.parametrize("function", NEEDED, ids=lambda each: each.value)
def test_drive_without_a_needed_object_is_no_drive_for_this_program(tmp_path: Path, function: Function) -> None:
    index = f"{TABLE[function].ways[0][0].index:04X}"
    report = checked(tmp_path, without(index))
    assert not report.usable
    (finding,) = (each for each in report.findings if each.place == f"[{index}]" and function.value in each.expected)
    assert (finding.severity, finding.line) == (E, line_of(SHIPPED, "OptionalObjects")) or index == "1018"


@pytest.mark.parametrize(
    ("gone", "lines"),
    [
        ("60A9", ['speed_unit = { unit = "rpm" }']),
        ("1016", ['accepted.heartbeat_consumer = { by = "NAME", why = "REASON" }']),
        ("1400sub5", ['accepted.rpdo_deadline = { by = "NAME", why = "REASON" }']),
        ("6007", ['accepted.abort_connection = { by = "NAME", why = "REASON" }']),
        ("60B2", []),
        ("603F", []),
        ("6072", []),
        ("6076", []),
    ],
)
def test_what_the_rig_file_has_to_say_instead(tmp_path: Path, gone: str, lines: list[str]) -> None:
    report = checked(tmp_path, without(gone))
    assert report.usable
    assert [line.text for line in report.lines] == lines


def test_option_code_without_a_value_or_for_good_is_no_fault(tmp_path: Path) -> None:
    """It is the drive's own: nothing is written."""
    blank = edited("605A", "DefaultValue=6", "DefaultValue=")
    assert checked(tmp_path, edited("605E", "AccessType=rw", "AccessType=const", text=blank)).findings == ()


def test_constant_that_holds_the_value_wanted_is_no_fault(tmp_path: Path) -> None:
    assert checked(tmp_path, edited("1005", "AccessType=rw", "AccessType=const")).findings == ()
    text = edited("1005", "AccessType=rw", "AccessType=const", text=edited("1005", "0x00000080", "0x00000081"))
    assert [each.severity for each in checked(tmp_path, text).findings if each.place.endswith("DefaultValue")] == [E]


def test_object_that_is_used_and_one_that_is_not(tmp_path: Path) -> None:
    """The same fault is an error in the one and a warning in the other."""
    vendors = "\n[2000]\nParameterName=x\nDataType=0x99\nAccessType=rw\n"
    listed = edited("ManufacturerObjects", "SupportedObjects=0", "SupportedObjects=1\n1=0x2000", text=SHIPPED + "\n")
    assert [each.severity for each in checked(tmp_path, listed + vendors).findings] == [W]
    used = checked(tmp_path, edited("6061", "DataType=0x0002", "DataType=0x99"))
    assert {each.severity for each in used.findings} == {E}


COMPACT = "\n[2000]\nParameterName=x\nObjectType=8\nDataType=6\nAccessType=rw\nDefaultValue=7\n{}\n"


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("CompactSubObj=3", []),
        ("CompactSubObj=3\nSubNumber=0", []),
        ("CompactSubObj=3\nSubNumber=4", ["0 next to CompactSubObj"]),
        ("CompactSubObj=255", ["a number from 0 to 254"]),
        ("CompactSubObj=few", ["sub-indices, or CompactSubObj"]),
        ("CompactSubObj=3\n[2000Name]\nNrOfEntries=2\n1=one\n2=two", []),
        ("CompactSubObj=3\n[2000Name]\nNrOfEntries=4", ["at most 3, CompactSubObj"]),
        ("SubNumber=0", ["sub-indices, or CompactSubObj"]),
    ],
)
def test_compact_description(tmp_path: Path, keys: str, said: list[str]) -> None:
    listed = edited("ManufacturerObjects", "SupportedObjects=0", "SupportedObjects=1\n1=0x2000", text=SHIPPED + "\n")
    findings = checked(tmp_path, listed + COMPACT.format(keys)).findings
    assert [each.severity for each in findings] == [W] * len(said)
    assert all(expected in finding.expected for expected, finding in zip(said, findings, strict=True))


@pytest.mark.parametrize(("gone", "left"), [("1800", "1A00"), ("1A00", "1800"), ("1400", "1600"), ("1600", "1400")])
def test_pdo_parameter_without_the_other(tmp_path: Path, gone: str, left: str) -> None:
    report = checked(tmp_path, without(gone))
    assert any(each.place == f"[{left}]" and f"0x{gone} next to it" in each.expected for each in report.findings)
    assert not report.usable


def test_mapping_over_eight_bytes_of_objects_that_are_not_there_or_not_filled(tmp_path: Path) -> None:
    """Mapped: 2 bytes that can't be, 4 more than fit, and a fourth entry that is not described."""
    text = edited("1A00sub2", "0x60770010", "0x20000120")
    text = edited("1A00sub1", "0x60410010", "0x606C0020", text=text)
    text = edited("1A00sub0", "DefaultValue=3", "DefaultValue=4", text=text)
    said = [each.expected for each in checked(tmp_path, text).findings]
    assert "at most 8 bytes mapped" in said
    assert any("sub-index 4, for sub-index 0 counts 4" in each for each in said)
    assert any(each.startswith("the index, sub-index and length of an object described") for each in said)


@pytest.mark.parametrize(
    ("mapping", "allowed", "wanted"), [("1600", "1", []), ("1600", "0", ["a filler"]), ("1A00", "1", ["a filler"])]
)
def test_filler_in_a_mapping(tmp_path: Path, mapping: str, allowed: str, wanted: list[str]) -> None:
    text = edited("DummyUsage", "Dummy0005=0", f"Dummy0005={allowed}")
    text = edited(f"{mapping}sub0", "DefaultValue=3", "DefaultValue=4", text=text)
    text = edited(mapping, "SubNumber=4", "SubNumber=5", text=text)
    entry = "ObjectType=0x7\nDataType=0x0007\nAccessType=rw\nDefaultValue=0x00050008\n"
    text += f"\n[{mapping}sub4]\nParameterName=Filler\n{entry}"
    findings = [each for each in checked(tmp_path, text).findings if not each.advice.startswith("A run maps it")]
    said = [each.expected for each in findings if "8 bytes" not in each.expected]
    assert len(said) == len(wanted)
    assert all(any(want in each for each in said) for want in wanted)


def test_node_guarding_is_reported_and_switched_off(tmp_path: Path) -> None:
    """It excludes the heartbeat; where it can't be switched off that is an error."""
    described = "\n[{}]\nParameterName=x\nDataType={}\nAccessType=rw\nDefaultValue={}\n"
    listed = edited("OptionalObjects", "SupportedObjects=35", "SupportedObjects=37\n36=0x100C\n37=0x100D")
    off = listed + described.format("100C", 6, 0) + described.format("100D", 5, 0)
    assert checked(tmp_path, off).findings == ()
    blank = listed + described.format("100C", 6, "") + described.format("100D", 5, "")
    assert checked(tmp_path, blank).usable
    on = listed + described.format("100C", 6, 100) + described.format("100D", 5, 3)
    assert places(checked(tmp_path, on), W) == ["[100C] DefaultValue"]
    assert places(
        checked(tmp_path, on.replace("AccessType=rw\nDefaultValue=3", "AccessType=ro\nDefaultValue=3")), E
    ) == ["[100C] DefaultValue"]


@pytest.mark.parametrize("mapping", ["1600", "1A00"])
def test_no_pdo_that_carries_what_is_needed(tmp_path: Path, mapping: str) -> None:
    """It is mapped by each run where it can be, and otherwise there is none."""
    needed = {"1600": "0x60710010", "1A00": "0x60770010"}[mapping]
    text = SHIPPED.replace(f"DefaultValue={needed}", "DefaultValue=0x60780010")
    (note,) = (each for each in checked(tmp_path, text).findings if each.place == f"[{mapping}]")
    assert (note.severity, note.advice.startswith("A run maps it: [COB-ID 0x")) == (N, True)
    locked = edited(f"{mapping}sub1", "AccessType=rw", "AccessType=ro", text=text)
    errors = [each for each in checked(tmp_path, locked).findings if each.severity is E]
    (finding,) = (each for each in errors if each.place == f"[{mapping}]")
    assert "that map 0x60" in finding.expected
    assert "0x6078:00 (16 bit)" in finding.found
    assert f"0x{mapping}:01 can not be written" in finding.found


def test_objects_of_the_table_are_those_of_the_documentation() -> None:
    """Each has its row, with what is done without it."""
    table = (DOCS / "supported-protocols.md").read_text().partition("| object | name | used for | without |")[2]
    rows = [row.split("|") for row in table.partition("\n\n")[0].splitlines()[2:]]
    without = {index: row[4].strip() for row in rows for index in re.findall(r"0x(\w{4})", row[1])}
    without |= {f"605{digit}": without["605A"] for digit in "BCD"}  # "0x605A to 0x605E"
    for row in TABLE.values():
        for part in (part for way in row.ways for part in way):
            refused = without[f"{part.index:04X}"].startswith("refused")
            assert refused is (row.without is Without.REFUSED) or part.index == 0x1018, f"0x{part.index:04X}"
