"""What a data sheet has wrong that would be read as other numbers, and what of a drive a run has to know."""

from pathlib import Path

import pytest

from drivers.capability.carrier import RPDO
from drivers.datasheet.text import Severity
from drivers.errors import ConfigMismatch
from drivers.resources import data_file
from tests.drivers.eds_bench import E, W, checked, edited, line_of
from tests.drivers.fake_drive import FakeDrive, on_bus

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


@pytest.mark.parametrize("value", ["0x00000065", "$NODEID", "$NODEID+0x40"])
def test_drive_without_a_torque_mode_is_reported(tmp_path: Path, value: str) -> None:
    """Also one that has a mode by chance, at some node ids."""
    text = edited("6502", "DefaultValue=0x00000208", f"DefaultValue={value}")
    reported = [each for each in checked(tmp_path, text).findings if each.place == "[6502] DefaultValue"]
    assert [each.severity for each in reported] == [W]
    assert "4 (profile torque) or 10 (cyclic synchronous torque)" in reported[0].expected


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
