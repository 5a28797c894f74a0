"""Another maker's drive, by its EDS and a few lines of the rig file: checked, configured, armed, under torque.

The EDS has the habits of real ones: torque in PDO2, blank PDOMapping, wrong counts, capitals, decimal formulas.
"""

from collections.abc import Iterator
from dataclasses import replace
from math import pi
from pathlib import Path

import pytest

from drivers.capability.speed_unit import SpeedUnit, SpeedUnitName
from drivers.capability.table import TABLE, Function, Without
from drivers.eds_check import check_eds
from drivers.errors import ConfigMismatch
from drivers.inverter.cia402 import PowerState
from drivers.inverter.inverter import Inverter
from drivers.inverter.settings import Acceptance
from drivers.resources import data_file
from hil.config.rig_file import read_rig
from hil.rig.build import inverter_settings
from hil.simulator.drive_physics import SimulatedInverter
from tests.drivers.can_bench import M1, SIMULATED_M1, Bench, bench, guarded
from tests.drivers.eds_bench import SHIPPED, without
from tests.simulator.rigid_plant import RigidPlant

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
OTHER_EDS = EXAMPLES / "other_drive.eds"
OTHER = replace(inverter_settings("m1", read_rig(EXAMPLES / "other_drive.toml")), sdo_timeout_s=M1.sdo_timeout_s)
SIMULATED = SimulatedInverter(OTHER.node_id, OTHER.rated_torque_nm, eds_path=OTHER_EDS)
COUNT_NM, COUNT_RAD_S = 0.45, 0.1 * 2 * pi / 60


@pytest.fixture
def other() -> Iterator[Bench]:
    plant = RigidPlant(100.0, 0.5, speed_rad_s=150.0)
    with bench(settings=OTHER, simulated=SIMULATED, plant=plant) as rig:
        yield rig


def test_its_habits_are_borne() -> None:
    report = check_eds(OTHER_EDS)
    assert report.usable
    assert [finding.place for finding in report.findings] == ["text"]


def test_the_whole_way_to_torque(other: Bench) -> None:
    assert other.m1.check() == ()
    other.m1.configure()
    other.m1.arm()
    other.cycle(guarded(135.0, 13.5))
    feedback = other.cycle(guarded(135.0, 13.5))
    assert other.rig.torque_nm[0] == pytest.approx(148.5)
    assert feedback.state is PowerState.OPERATION_ENABLED
    assert feedback.torque_nm == pytest.approx(feedback.torque_raw * COUNT_NM)
    assert feedback.torque_nm == pytest.approx(148.5, abs=5 * COUNT_NM)
    assert feedback.speed_rad_s == pytest.approx(feedback.speed_raw * COUNT_RAD_S)
    assert feedback.speed_rad_s == pytest.approx(150.0, abs=0.5)
    other.m1.disarm()
    assert other.rig.torque_nm[0] == 0.0
    assert other.m1.check() == ()


def test_drive_is_refused_with_the_shipped_eds(other: Bench) -> None:
    """It is another device, another unit of speed, and its torque is in another PDO."""
    with bench(settings=replace(OTHER, eds_path=None), simulated=SIMULATED) as rig:
        with pytest.raises(ConfigMismatch, match="SI unit velocity 0x60A9"):
            rig.m1.configure()
        assert rig.rig.torque_nm[0] == 0.0


NEEDED = [row.function for row in TABLE.values() if row.without is Without.REFUSED]
OPTIONAL = [row.function for row in TABLE.values() if row.without in (Without.DONE, Without.RIG_FILE)]
ACCEPTED = {
    name: Acceptance("a test", "simulated") for name in ("heartbeat_consumer", "rpdo_deadline", "abort_connection")
}


@pytest.mark.parametrize("function", NEEDED, ids=lambda each: each.value)
def test_what_the_checker_calls_needed_the_driver_does_not_do_without(function: Function, tmp_path: Path) -> None:
    """An EDS without the object: this program stops at it, before there is torque, and names it."""
    index = TABLE[function].ways[0][0].index
    eds = tmp_path / "poor.eds"
    eds.write_text(without(f"{index:04X}"))
    assert not check_eds(eds).usable
    with pytest.raises(ConfigMismatch, match=f"0x{index:04X}"), bench() as rig:
        whole_way(rig, eds)


@pytest.mark.parametrize("function", OPTIONAL, ids=lambda each: each.value)
def test_what_the_checker_can_do_without_the_driver_does_without(function: Function, tmp_path: Path) -> None:
    """An EDS without any of the objects that give it, and a drive that does not have them: it runs all the same."""
    text = SHIPPED
    for part in (part for way in TABLE[function].ways for part in way):
        section = f"{part.index:04X}sub{part.subindex}" if part.subindex else f"{part.index:04X}"
        text = without(section, text) if f"[{section}]" in text else text
    eds = tmp_path / "lacking.eds"
    eds.write_text(text)
    report = check_eds(eds)
    assert report.usable
    unit = SpeedUnit(SpeedUnitName.RPM, 1000.0)
    settings = replace(M1, eds_path=eds, accepted=ACCEPTED, speed_unit=unit)
    with bench(settings=settings, simulated=replace(SIMULATED_M1, eds_path=eds, speed_unit=unit)) as rig:
        assert rig.m1.check() == ()
        rig.m1.configure()
        rig.m1.arm()
        rig.cycle(guarded(120.0, 60.0))
        feedback = rig.cycle(guarded(120.0, 60.0))
        assert rig.rig.torque_nm[0] == pytest.approx(180.0)
        assert feedback.state is PowerState.OPERATION_ENABLED
        rig.m1.disarm()
        assert rig.rig.torque_nm[0] == 0.0


def whole_way(rig: Bench, eds: Path) -> None:
    """Drive m1 by another EDS, on the same link."""
    m1 = Inverter(rig.link, replace(M1, eds_path=eds))
    m1.check()
    m1.fault()
    m1.configure()
    m1.arm()


def test_shipped_eds_goes_the_whole_way() -> None:
    """Without this the test above might fail for another reason than the missing object."""
    with bench() as rig:
        whole_way(rig, data_file("inverter.eds"))
