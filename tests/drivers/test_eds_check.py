"""What the EDS checker says of a whole file, where one fault has consequences or is reported once for many places."""

from pathlib import Path

import pytest

from drivers.capability.carrier import RPDO
from drivers.capability.table import TABLE, Function, Without
from drivers.datasheet.text import Severity
from drivers.eds_check import EdsReport
from drivers.errors import ConfigMismatch
from drivers.resources import data_file
from tests.drivers.eds_bench import SHIPPED, E, N, W, checked, edited, line_of, without
from tests.drivers.fake_drive import FakeDrive, on_bus


def places(report: EdsReport, severity: Severity) -> list[str]:
    return [finding.place for finding in report.findings if finding.severity is severity]


def test_file_without_device_info_is_none(tmp_path: Path) -> None:
    report = checked(tmp_path, without("DeviceInfo"))
    (finding,) = report.findings
    assert (finding.severity, finding.line, finding.place) == (E, None, "[DeviceInfo]")


@pytest.mark.parametrize("section", ["FileInfo", "MandatoryObjects", "OptionalObjects", "1000", "1001"])
def test_what_no_run_reads_may_be_missing(tmp_path: Path, section: str) -> None:
    assert checked(tmp_path, without(section)).findings == ()


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
    """The same fault is an error in the one and nothing in the other."""
    vendors = "\n[2000]\nParameterName=x\nDataType=0x99\nAccessType=rw\n"
    listed = edited("ManufacturerObjects", "SupportedObjects=0", "SupportedObjects=1\n1=0x2000", text=SHIPPED + "\n")
    assert checked(tmp_path, listed + vendors).findings == ()
    used = checked(tmp_path, edited("6061", "DataType=0x0002", "DataType=0x99"))
    assert {each.severity for each in used.findings} == {E}


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


COUNTER = """[1019]
ParameterName=Synchronous counter overflow value
ObjectType=0x7
DataType=0x0005
AccessType=rw
DefaultValue=10
PDOMapping=0

"""


@pytest.mark.parametrize(
    ("index", "old", "new"),
    [
        ("6077", "0x0003", "0x0006"),
        ("6077", "0x0003", "0x0004"),
        ("6071", "0x0003", "0x0006"),
        ("606C", "0x0004", "0x0007"),
        ("606C", "0x0004", "0x0003"),
        ("6061", "0x0002", "0x0005"),
        ("6041", "0x0006", "0x0007"),
    ],
)
def test_used_object_of_another_sign_or_width_is_an_error_of_the_check(
    index: str, old: str, new: str, tmp_path: Path
) -> None:
    text = edited(index, f"DataType={old}", f"DataType={new}")
    report = checked(tmp_path, text)
    assert not report.usable
    [finding] = [each for each in report.findings if each.place == f"[{index}] DataType" and each.severity is E]
    assert finding.line == line_of(text, index, "DataType")


def test_torque_offset_without_a_sign_is_done_without(tmp_path: Path) -> None:
    """Base torque and PRBS go into the target torque as a sum, so that nothing is read as another number."""
    text = edited("60B2", "DataType=0x0003", "DataType=0x0006")
    report = checked(tmp_path, text)
    assert report.usable
    [finding] = [each for each in report.findings if each.place == "[60B2] DataType"]
    assert finding.severity is W
    assert finding.line == line_of(text, "60B2", "DataType")
    assert report.plan is not None
    assert 0x60B2 not in {mapped.index for mapped in report.plan.pdos(RPDO)[0].layout.objects}


def with_counter(access: str = "rw") -> str:
    text = data_file("inverter.eds").read_text(encoding="utf-8")
    text = text.replace("[1029]", COUNTER.replace("AccessType=rw", f"AccessType={access}") + "[1029]", 1)
    count = next(line for line in text.split("[OptionalObjects]")[1].splitlines() if line.startswith("SupportedObj"))
    number = int(count.split("=")[1])
    return text.replace(count, f"SupportedObjects={number + 1}\n{number + 1}=0x1019", 1)


@pytest.mark.parametrize(("access", "severity"), [("rw", W), ("const", E)])
def test_sync_counter_is_reported(access: str, severity: Severity, tmp_path: Path) -> None:
    reported = [
        each for each in checked(tmp_path, with_counter(access)).findings if each.place == "[1019] DefaultValue"
    ]
    assert [each.severity for each in reported] == [severity]


class CountsSync(FakeDrive):
    """Takes no SYNC without a counter while 0x1019 is not 0, and says so by EMCY 0x8240 (CiA 301, 7.2.2.5)."""

    def take_sync(self, data: bytes) -> None:
        if self.objects[0x1019, 0] and len(data) != 1:
            self.link.send(0x080 + self.node_id, bytes.fromhex("40 82 11 00 00 00 00 00"))
        else:
            super().take_sync(data)


def test_drive_that_counts_syncs_for_good_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "drive.eds"
    path.write_text(with_counter("const"), encoding="utf-8")
    with pytest.raises(ConfigMismatch, match=r"0x1019:00 that is 0 or can be written, found 10 for good"):
        with on_bus(CountsSync, eds_path=path):
            pass
