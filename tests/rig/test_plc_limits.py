"""The PLC's limits in words; what is beyond three times the drives' own is refused, whatever made it so."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from hil.commission.talk import Script
from hil.errors import RunAborted
from hil.rig.plc_watch import MOST_OF_RATED, plc_limits
from hil.simulator.plc_device import PlcSetup
from tests.commission.rigs import bench
from tests.commission.test_engine import person
from tests.rig.serving import changed, small_rig
from tests.rig.test_fitness import FIT

RATED_NM, RPM = 600.0, 2.0 * math.pi / 60.0


@pytest.mark.parametrize(
    ("torque_nm", "believed"), [(450.0, True), (MOST_OF_RATED * RATED_NM, True), (4500.0, False), (1800.1, False)]
)
def test_a_torque_limit_beyond_three_times_rated_torque_is_not_believed(torque_nm: float, believed: bool) -> None:
    torque, _ = plc_limits(replace(FIT, torque_limit_nm=torque_nm), small_rig(), None)
    assert torque.believed is believed
    assert f"the PLC allows {torque_nm:,g} Nm" in torque.question
    assert "rated 600 Nm" in torque.question


@pytest.mark.parametrize("factor", [1.0, 1.0 / RPM])
@pytest.mark.parametrize("source", ["the drives", "the rig file"])
def test_a_speed_limit_in_another_unit_is_not_believed(source: str, factor: float) -> None:
    """320 rad/s, and the number of its revolutions per minute taken for rad/s."""
    limit_rad_s = 300.0
    rig = small_rig() if source == "the drives" else changed(small_rig(), {"guard": {"speed_limit_rad_s": limit_rad_s}})
    drives_rad_s = limit_rad_s if source == "the drives" else None
    _, speed = plc_limits(replace(FIT, speed_limit_rad_s=320.0 * factor), rig, drives_rad_s)
    assert speed.believed is (factor == 1.0)
    assert f"{source} 300 rad/s (2,865 rpm)" in speed.question


@pytest.mark.parametrize("torque_nm", [pytest.param(450.0, marks=pytest.mark.campaign), 4500.0])
def test_commissioning_asks_before_any_torque(torque_nm: float, tmp_path: Path) -> None:
    with bench(tmp_path) as rig:
        rig.server.plc._setup = PlcSetup(torque_limit_nm=torque_nm)
        believed = torque_nm == 450.0
        with pytest.raises(RunAborted, match="answer was no" if believed else "at most 1,800 Nm, 3 times rated torque"):
            rig.call("limits", talk=person("y", "n") if believed else Script(True))
        if believed:
            assert rig.call("limits", talk=person("y", "yes")).steps["limits"].status.is_settled
