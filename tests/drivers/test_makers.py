"""Every maker's drive by its data sheet: checked, a rig file written, simulated, driven; and mutants of each file."""

import re
from pathlib import Path

import numpy as np
import pytest

from drivers.canopen.can_link import CanLink
from drivers.canopen.pdo_map import COB_ID_INVALID
from drivers.capability.carrier import RPDO
from drivers.capability.plan import plan_drive
from drivers.datasheet.file import Commissioning, EdsFile, read_commissioning
from drivers.datasheet.text import Severity, read_eds_text
from drivers.eds_check import check_eds
from drivers.errors import ConfigMismatch
from drivers.inverter.inverter import Inverter
from hil.cli.main import run as command
from hil.config.rig_file import read_rig
from hil.rig.build import inverter_settings, open_devices
from hil.rig.pacing import FREE_PATIENCE_S
from tests.benchmarks.data_sheets import RAN, REFUSED, maker_files, mutant_verdicts, verdict
from tests.chosen import one_in
from tests.drivers.maker_files import (
    COMPLETE,
    EPOS_DCF,
    FIXED,
    I8,
    I16,
    MAKERS,
    U8,
    U16,
    U32,
    Entry,
    Maker,
    fixed,
    pdo,
    pdos,
)
from tests.drivers.maker_rig import drive, written_rig
from tests.real.conftest import real_recording
from tests.rig.serving import changed, served

SHORT = 40
MUTANTS = 2


def written(maker: Maker, folder: Path) -> Path:
    path = folder / f"drive{maker.suffix}"
    path.write_bytes(maker.text().encode("latin-1"))
    return path


def makers(*at_every_change: str) -> pytest.MarkDecorator:
    """Try every maker's drive in the campaign, and these at every change."""
    marks = {name: () if name in at_every_change else pytest.mark.campaign for name in MAKERS}
    return pytest.mark.parametrize(
        "maker", [pytest.param(made, id=name, marks=marks[name]) for name, made in MAKERS.items()]
    )


@makers(*MAKERS)
def test_usable_with_the_lines_that_are_printed(maker: Maker, tmp_path: Path) -> None:
    report = check_eds(written(maker, tmp_path))
    assert report.usable, [str(each) for each in report.findings]
    assert tuple(line.key for line in report.lines) == maker.lines


@makers("sevcon", "yiyou", "each value apart", "simpliq")
def test_driven_without_a_flag_and_with_its_prbs_apart(maker: Maker, tmp_path: Path) -> None:
    driven = drive(written(maker, tmp_path), tmp_path, SHORT)
    assert (driven.recorded, driven.flagged, driven.before, driven.after) == (SHORT, 0, (), ())
    prbs = np.array(driven.samples.column("prbs_nm"))
    reference = sum(np.array(driven.samples.column(f"torque_ref_{name}_nm")) for name in ("m1", "m2"))
    torque = sum(np.array(driven.samples.column(f"torque_{name}_nm")) for name in ("m1", "m2"))
    assert set(np.abs(prbs)) == {prbs.max()} != {0.0}
    assert np.abs(torque - reference).max() < 8.0  # rounding of two drives, and 0.5 per mille of noise
    assert np.abs(reference).max() > prbs.max()  # the base torque is next to it


@pytest.mark.campaign
@makers("complete", "pre-defined PDOs", "simpliq")
def test_mutants_run_or_are_refused_by_line(maker: Maker, tmp_path: Path) -> None:
    eds = written(maker, tmp_path)
    place = tmp_path / "mutant"
    place.mkdir()
    found = dict(mutant_verdicts(eds, place, MUTANTS, 1, SHORT))
    assert {each: what for each, what in found.items() if what not in (RAN, REFUSED)} == {}


def test_commands_of_a_new_user(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What `hil check --eds` prints is pasted, and with it the rig file is read."""
    eds = written(MAKERS["technosoft"], tmp_path)
    rig = tmp_path / "rig.toml"
    assert command(["rig", "new", str(rig), "--eds", str(eds), "--simulated", "--yes"]) == 0
    capsys.readouterr()
    assert command(["check", "--eds", str(eds)]) == 0
    printed = capsys.readouterr().out.splitlines()
    pasted = printed[printed.index("# under [inverters.m1] and [inverters.m2] of the rig file:") + 1 : -1]
    assert printed[-1].startswith(f"{eds}: usable with the lines above")
    usual = tmp_path / "usual.toml"
    assert command(["rig", "new", str(usual), "--simulated", "--yes"]) == 0
    text = usual.read_text().replace("heartbeat_ms = 100", 'heartbeat_ms = 100\neds = "drive.eds"')
    text = text.replace('eds = "drive.eds"', "\n".join(('eds = "drive.eds"', *pasted)))
    usual.write_text(text)
    assert not read_rig(usual).inverters.m1.accepted.by_name["rpdo_deadline"].is_by_a_person
    usual.write_text(text.replace('"NAME"', '"A. Nyone"').replace('"REASON"', '"a relay of its own"'))
    accepted = read_rig(usual).inverters.m1.accepted.by_name
    assert set(accepted) == {"supported_modes", "heartbeat_consumer", "rpdo_deadline"}
    assert str(accepted["rpdo_deadline"]) == "accepted by A. Nyone: a relay of its own"


def test_dcf_gives_node_id_and_bit_rate(tmp_path: Path) -> None:
    eds, rig = written(MAKERS["epos, commissioned"], tmp_path), tmp_path / "rig.toml"
    options = "--plc 10.0.0.1:502 --vendor-id 1 --product-code 1 --rated-torque-nm 10 --torque-limit-nm 5"
    more = ["--inertia-kg-m2", "1", "--speed-rad-s", "9"]
    assert command(["rig", "new", str(rig), "--eds", str(eds), "--yes", *options.split(), *more]) == 0
    read = read_rig(rig)
    assert (read.inverters.m1.node_id, read.inverters.m2.node_id) == (1, 2)
    assert read.can.url == "socketcan:can0?bitrate=250000"


def test_parameter_value_says_nothing_in_an_eds(tmp_path: Path) -> None:
    sheet = EdsFile(written(MAKERS["e35"], tmp_path), 1).sheet
    assert (sheet.value(0x100C), sheet.commissioned(0x100C), sheet.commissioning) == (None, None, None)


def test_identifiers_of_another_node_are_replaced_and_the_others_switched_off(tmp_path: Path) -> None:
    rig = written_rig(written(MAKERS["sevcon"], tmp_path), tmp_path)
    with served(rig) as (_, at), open_devices(at, FREE_PATIENCE_S) as devices:
        for inverter in (devices.m1, devices.m2):
            node, sdo = inverter.settings.node_id, inverter._sdo
            assert sdo.upload(0x1801, 1) == 0x302
            inverter.configure()
            assert [sdo.upload(index, 1) for index in (0x1400, 0x1800)] == [0x200 + node, 0x180 + node]
            assert sdo.upload(0x1801, 1) == 0x302 | COB_ID_INVALID
            assert sdo.upload(0x1005) == 0x80
            assert sdo.upload(0x1014) == 0x80 + node


def test_fixed_mapping_that_the_drive_does_not_hold_is_refused(tmp_path: Path) -> None:
    """The drive is of another firmware: its mapping is not the file's, and can't be changed."""
    host = written_rig(written(MAKERS["fixed mapping"], tmp_path), tmp_path)
    (tmp_path / "device").mkdir()
    mapping = {**MAKERS["fixed mapping"].objects[0x1600], 3: Entry(U32, "const", "0x60FF0020")}  # type: ignore[dict-item]
    other = written(MAKERS["fixed mapping"].having({0x1600: mapping}), tmp_path / "device")
    with served(changed(host, {"inverters.m1": {"eds": other}})) as (_, at):
        described = changed(at, {"inverters.m1": {"eds": tmp_path / "drive.eds"}})
        with CanLink.open(at.can.url) as link:
            m1 = Inverter(link, inverter_settings("m1", described))
            assert [each.what for each in m1.check()] == ["PDO 0x1400/0x1600"]
            with pytest.raises(ConfigMismatch, match=r"0x60FF:00 .* expected .*0x60B2:00 .* and can't be given it"):
                m1.configure()


def test_heartbeat_that_is_there_for_good_counts(tmp_path: Path) -> None:
    slow = COMPLETE.having({0x1017: Entry(6, "const", "250")})
    report = check_eds(written(slow, tmp_path))
    assert "heartbeat_ms = 250" in [line.text for line in report.lines]
    (tmp_path / "drive").mkdir()
    assert drive(written(slow, tmp_path), tmp_path / "drive", SHORT).flagged == 0


@pytest.mark.parametrize("room", [2, 3])
def test_mapping_with_little_room_carries_the_sum(room: int, tmp_path: Path) -> None:
    narrow = COMPLETE.having(pdos(0x1400, pdo("$NODEID+0x200", "255", "0x60400010", room=room))).but(0x1401, 0x1601)
    path = written(narrow, tmp_path)
    objects = plan_drive(EdsFile(path, 1).sheet).pdos(RPDO)[0].layout.objects
    assert [mapped.index for mapped in objects] == [0x6040, 0x6071, 0x60B2][:room]
    assert drive(path, tmp_path, SHORT).flagged == 0


@pytest.mark.parametrize(
    "name", ["elmo_gold.dcf", "epos4_50_15.dcf", "sevcon_gen4.eds", "technosoft_ipos.eds", "yiyou.eds"]
)
def test_makers_own_files_as_far_as_they_are_there(name: str, tmp_path: Path) -> None:
    assert verdict(real_recording(f"eds/{name}"), tmp_path, SHORT) == RAN


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_every_file_of_the_folder_and_its_mutants(tmp_path: Path) -> None:
    missed = {}
    for eds in maker_files(real_recording("eds")):
        found = {"": verdict(eds, tmp_path, 400)} | dict(mutant_verdicts(eds, tmp_path, 100, 1, 400))
        missed |= {f"{eds.name} {each}": what for each, what in found.items() if what not in (RAN, REFUSED)}
    assert missed == {}


SHORT_RUN = 20


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

REFUSED_ODD = {
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


def written_odd(maker: Maker, folder: Path) -> Path:
    path = folder / f"drive{maker.suffix}"
    path.write_text(maker.text(), encoding="latin-1")
    return path


@pytest.mark.parametrize("name", one_in(3, USABLE))
def test_what_changes_nothing_is_no_hindrance(name: str, tmp_path: Path) -> None:
    path = written_odd(USABLE[name], tmp_path)
    report = check_eds(path)
    assert report.usable, [str(each) for each in report.findings if each.severity is Severity.ERROR]
    assert tuple(line.key for line in report.lines) == USABLE[name].lines
    driven = drive(path, tmp_path, SHORT_RUN)
    assert (driven.recorded, driven.flagged, driven.before, driven.after) == (SHORT_RUN, 0, (), ())


@pytest.mark.parametrize("name", REFUSED_ODD)
def test_what_does_is_said_with_its_line(name: str, tmp_path: Path) -> None:
    maker, said = REFUSED_ODD[name]
    errors = [each for each in check_eds(written_odd(maker, tmp_path)).findings if each.severity is Severity.ERROR]
    assert any(said in str(each) and each.line is not None for each in errors), [str(each) for each in errors]


@pytest.mark.parametrize(
    ("node", "rate", "read"),
    [
        ("0x7F", "0xFA", Commissioning(127, 250)),
        ("0", "1000", Commissioning(None, 1000)),
        ("128", "250000", Commissioning(None, None)),
        ("", "250 kbit", Commissioning(None, None)),
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
