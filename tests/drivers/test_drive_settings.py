"""What a drive is given at every configuration, who asks for it, and what is refused."""

from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import pytest

from drivers.capability.plan import plan_drive
from drivers.datasheet.file import EdsFile
from drivers.errors import ConfigMismatch
from drivers.inverter.drive_settings import drive_settings
from drivers.inverter.inverter import InverterSettings
from drivers.resources import data_file
from tests.drivers.can_bench import M1, SIMULATED_M1, bench

NODE_GUARDING = """
[100C]
ParameterName=Guard time
ObjectType=0x7
DataType=0x0006
AccessType=rw
DefaultValue={guard_ms}
PDOMapping=0

[100D]
ParameterName=Life time factor
ObjectType=0x7
DataType=0x0005
AccessType=rw
DefaultValue={factor}
PDOMapping=0
"""


def given(settings: InverterSettings) -> dict[tuple[int, int], tuple[int, str]]:
    eds = EdsFile(settings.eds_path, settings.node_id)
    listed = drive_settings(plan_drive(eds.sheet), settings)
    return {(each.index, each.subindex): (each.value, each.source) for each in listed}


def changed_eds(folder: Path, *changes: tuple[str, str], more: str = "") -> Path:
    text = data_file("inverter.eds").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "changed.eds"
    path.write_text(text + more)
    return path


def test_the_drive_is_made_to_watch_its_host_in_three_ways() -> None:
    settings = given(replace(M1, rpdo_deadline_ms=150))
    assert settings[0x1016, 1] == (127 << 16 | 150, "rig file")
    assert settings[0x1400, 5] == (150, "rig file")
    assert settings[0x1017, 0] == (M1.heartbeat_ms, "rig file")
    assert (0x6007, 0) not in settings  # the third, as the drive has it


def test_option_codes_are_the_rig_file_s_or_a_dcf_s_and_never_an_eds_s_default(tmp_path: Path) -> None:
    settings = given(replace(M1, option_codes={0x605A: 5, 0x6007: 1}))
    assert settings[0x605A, 0] == (5, "rig file")
    assert settings[0x6007, 0] == (1, "rig file")
    assert (0x605E, 0) not in settings
    head = "[605E]\nParameterName=Fault reaction option code\nObjectType=0x7\n"
    eds = changed_eds(tmp_path, (head, f"{head}ParameterValue=2\n"))
    assert (0x605E, 0) not in given(replace(M1, eds_path=eds))
    dcf = eds.rename(tmp_path / "changed.dcf")
    assert given(replace(M1, eds_path=dcf))[0x605E, 0] == (2, "DCF")
    assert given(replace(M1, eds_path=dcf, option_codes={0x605E: 1}))[0x605E, 0] == (1, "rig file")


def test_what_is_listed_is_what_will_be_written() -> None:
    eds = EdsFile(M1.eds_path, M1.node_id)
    first, *_ = drive_settings(plan_drive(eds.sheet), M1)
    with pytest.raises(FrozenInstanceError):
        first.value = 1  # type: ignore[misc]


def test_torque_slope_is_written_in_per_mille_of_rated_torque_where_the_rig_file_gives_it() -> None:
    assert (0x6087, 0) not in given(M1)
    assert given(replace(M1, torque_slope_nm_per_s=600.0))[0x6087, 0] == (1000, "rig file")


@pytest.mark.parametrize("from_rig_file", [True, False])
def test_a_drive_that_would_keep_its_torque_without_the_host_is_refused(from_rig_file: bool, tmp_path: Path) -> None:
    head = "[6007]\nParameterName=Abort connection option code\nObjectType=0x7\nDataType=0x0003\nAccessType=rw\n"
    settings = (
        replace(M1, option_codes={0x6007: 0})
        if from_rig_file
        else replace(M1, eds_path=changed_eds(tmp_path, (f"{head}DefaultValue=2", f"{head}DefaultValue=0")))
    )
    with pytest.raises(ConfigMismatch, match=r"0x6007:00 is to be 0, no action .*the torque would stay without the ho"):
        given(settings)


@pytest.mark.parametrize("settings", [replace(M1, option_codes={0x605A: 1}), replace(M1, torque_slope_nm_per_s=1.0)])
def test_a_value_for_an_object_the_drive_lacks_is_refused(settings: InverterSettings, tmp_path: Path) -> None:
    eds = changed_eds(
        tmp_path, ("[605A]", "[2F5A]"), ("[6087]", "[2F87]"), ("=0x605A", "=0x2F5A"), ("=0x6087", "=0x2F87")
    )
    with pytest.raises(
        ConfigMismatch, match=r"the rig file gives a value for .* which EDS .* does not have, or not to"
    ):
        given(replace(settings, eds_path=eds))


@pytest.mark.parametrize("factor", [3, 0, ""], ids=["on", "zero", "blank"])
def test_node_guarding_is_switched_off(tmp_path: Path, factor: int | str) -> None:
    eds = changed_eds(tmp_path, more=NODE_GUARDING.format(guard_ms=100, factor=factor))
    settings = given(replace(M1, eds_path=eds))
    assert settings[0x100C, 0] == settings[0x100D, 0] == (0, "this program")


def test_node_guarding_that_can_t_be_written_is_left_alone(tmp_path: Path) -> None:
    fixed = NODE_GUARDING.format(guard_ms=0, factor=0).replace("AccessType=rw", "AccessType=ro")
    assert not {(0x100C, 0), (0x100D, 0)} & {*given(replace(M1, eds_path=changed_eds(tmp_path, more=fixed)))}


def test_half_of_node_guarding_is_none_and_left_alone(tmp_path: Path) -> None:
    guard_time, factor = NODE_GUARDING.format(guard_ms=100, factor=3).split("\n\n")
    for half in (guard_time, f"\n{factor}"):
        assert not {(0x100C, 0), (0x100D, 0)} & {*given(replace(M1, eds_path=changed_eds(tmp_path, more=half)))}


SYNC = "[1005]\nParameterName=COB-ID SYNC message\nObjectType=0x7\nDataType=0x0007\nAccessType="


@pytest.mark.parametrize(("access", "value"), [("rw", "0x81"), ("ro", "0x80"), ("ro", ""), ("ro", "0x81")])
def test_sync_comes_by_its_usual_identifier_or_the_drive_is_refused(tmp_path: Path, access: str, value: str) -> None:
    text = data_file("inverter.eds").read_text()
    before = text[text.index(SYNC) :].split("PDOMapping")[0]
    settings = replace(M1, eds_path=changed_eds(tmp_path, (before, f"{SYNC}{access}\nDefaultValue={value}\n")))
    if (access, value) == ("ro", "0x81"):
        with pytest.raises(ConfigMismatch, match="COB-ID SYNC 0x1005:00 that is 0x00000080 or can be written"):
            given(settings)
    else:
        assert given(settings).get((0x1005, 0)) == ((0x80, "this program") if access == "rw" else None)


def test_slope_and_codes_are_in_the_drive_after_configuring_and_in_the_list_before() -> None:
    settings = replace(M1, torque_slope_nm_per_s=300.0, option_codes={0x605A: 5})
    with bench(settings=settings) as rig:
        assert rig.m1.check() == ()
        assert rig.m1.remarks() == (
            "quick stop option code 0x605A:00 is 6, a run gives it 5 (rig file)",
            "torque slope 0x6087:00 is 100000, a run gives it 500 (rig file)",
        )
        rig.m1._sdo.download(0x605A, 0, 2)
        assert [(each.what, each.expected, each.found) for each in rig.m1.check()] == [
            ("quick stop option code 0x605A:00", "5", "2")
        ]
        rig.m1.configure()
        assert rig.m1.check() == rig.m1.remarks() == ()
        assert rig.m1._sdo.upload(0x6087) == 500
        assert rig.m1._sdo.upload(0x1400, 5) == M1.rpdo_deadline_ms


def test_a_drive_that_is_guarded_is_found_and_set_right(tmp_path: Path) -> None:
    """Some other master left it on; the EDS has it off."""
    eds = changed_eds(tmp_path, more=NODE_GUARDING.format(guard_ms=0, factor=0))
    with bench(settings=replace(M1, eds_path=eds), simulated=replace(SIMULATED_M1, eds_path=eds)) as rig:
        rig.m1._sdo.download(0x100C, 0, 100)
        [difference] = rig.m1.check()
        assert str(difference) == (
            "inverter m1 (node 5): guard time (heartbeat instead) 0x100C:00 is 100, expected 0 (this program)"
        )
        rig.m1.configure()
        assert rig.m1.check() == ()


EMCY = "[1014]\nParameterName=COB-ID EMCY\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\nDefaultValue=$NODEID+0x80\n"
NO_ERROR_CODE = (("[603F]", "[2F3F]"), ("=0x603F", "=0x2F3F"))


@pytest.mark.parametrize("has_error_code", [True, False])
@pytest.mark.parametrize("access", ["ro", "rw"])
@pytest.mark.parametrize(
    ("default", "of_another", "own"),
    [
        ("$NODEID+0x80", False, True),
        ("0x85", False, True),
        ("0x81", True, False),  # node 1's, and node 127's
        ("0xFF", True, False),
        ("0x80", False, False),  # of no node: it is heard by nobody, and taken for nobody else's
        ("0x100", False, False),
        ("0x80000085", False, False),
        ("", False, False),
    ],
)
def test_emcy_is_moved_where_it_alone_tells_the_cause_or_is_taken_for_another_node_s(
    tmp_path: Path, has_error_code: bool, access: str, default: str, of_another: bool, own: bool
) -> None:
    entry = EMCY.replace("AccessType=ro", f"AccessType={access}").replace("$NODEID+0x80", default)
    eds = changed_eds(tmp_path, (EMCY, entry), *(() if has_error_code else NO_ERROR_CODE))
    moved = access == "rw" and not own and (of_another or not has_error_code)
    settings = given(replace(M1, eds_path=eds))
    assert ((0x1014, 0) in settings) == moved
    assert settings.get((0x1014, 0), (0x85, "this program")) == (0x85, "this program")


COUNTER = """
[1019]
ParameterName=Synchronous counter overflow value
ObjectType=0x7
DataType=0x0005
AccessType={access}
DefaultValue={value}
PDOMapping=0
"""


@pytest.mark.parametrize(("access", "value", "written"), [("rw", 10, True), ("rw", 0, True), ("ro", 0, False)])
def test_the_sync_counter_is_switched_off(tmp_path: Path, access: str, value: int, written: bool) -> None:
    eds = changed_eds(tmp_path, more=COUNTER.format(access=access, value=value))
    found = given(replace(M1, eds_path=eds)).get((0x1019, 0))
    assert found == ((0, "this program") if written else None)


HEARTBEAT = (
    "[1017]\nParameterName=Producer heartbeat time\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\nDefaultValue="
)


@pytest.mark.parametrize(("default", "heartbeat_ms"), [("200", 199), ("200", 200), ("", 1), ("50", 100)])
def test_a_heartbeat_that_can_t_be_set_has_to_be_as_often_as_asked_for(
    tmp_path: Path, default: str, heartbeat_ms: int
) -> None:
    text = data_file("inverter.eds").read_text()
    written = text[text.index(HEARTBEAT) + len(HEARTBEAT) :].split("\n")[0]
    fixed = HEARTBEAT.replace("AccessType=rw", "AccessType=ro")
    eds = changed_eds(tmp_path, (f"{HEARTBEAT}{written}", f"{fixed}{default}"))
    settings = replace(M1, eds_path=eds, heartbeat_ms=heartbeat_ms)
    if heartbeat_ms == 199:
        with pytest.raises(ConfigMismatch, match="heartbeat_ms is 199, expected at least 200"):
            given(settings)
    else:
        assert (0x1017, 0) not in given(settings)
