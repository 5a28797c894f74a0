"""Each device is lost in each step that drives: reported by its name, noted, and the next call continues there."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest

from drivers.errors import DriverError
from hil.commission.state import Status
from hil.errors import RunAborted
from tests.commission.rigs import bench
from tests.rig.observer import assert_disarmed

SHORT = (("duration_s = 30.0", "duration_s = 6.0"), ("speed_rad_s = 60.0", "speed_rad_s = 6.0"))

DRIVEN = ("noise", "signs", "scales", "friction", "prbs", "experiments")

LOST = {"m1.hang@2.0": "m1", "m2.hang@2.0": "m2", "plc.hang@2.0": "PLC", "bus.off@2.0": "bus"}
"""What is lost after two seconds of simulated time, and what has to be named."""

OTHERS = {"m1": 2, "m2": 1}
"""CANopen node that is still there when an inverter is lost."""

SHORT_FORM = {("friction", "bus.off@2.0")}
"""Every device in every step is a campaign; this one leaves both drives to themselves."""


@pytest.mark.parametrize(
    ("step", "fault"),
    [
        pytest.param(step, fault, marks=() if (step, fault) in SHORT_FORM else pytest.mark.campaign)
        for step, fault in product(DRIVEN, LOST)
    ],
)
def test_a_lost_device_is_named_and_the_step_is_done_once_it_is_back(step: str, fault: str, tmp_path: Path) -> None:
    with bench(tmp_path, changes=SHORT, faults=[fault]) as rig:
        with pytest.raises((RunAborted, DriverError)) as ended:
            rig.call(step)
        record = rig.job().state.steps[step]
        if fault.startswith("plc"):
            assert_disarmed(rig.server.bus_url, 1, 2)
        elif LOST[fault] in OTHERS:
            assert_disarmed(rig.server.bus_url, OTHERS[LOST[fault]])
    assert LOST[fault] in str(ended.value)
    assert record.status is Status.INTERRUPTED
    assert LOST[fault] in record.because
    with bench(tmp_path, changes=SHORT) as mended:
        assert mended.call(step).steps[step].status is Status.DONE


@pytest.mark.parametrize(
    ("fault", "device"),
    [("m1.absent", "m1"), pytest.param("m2.absent", "m2", marks=pytest.mark.campaign), ("plc.hang@0.0", "plc")],
)
def test_a_device_that_is_not_there_blocks_and_is_found_once_it_is_back(
    fault: str, device: str, tmp_path: Path
) -> None:
    with bench(tmp_path, faults=[fault]) as rig:
        with pytest.raises(RunAborted):
            rig.call("devices")
        outside = [finding for finding in rig.shown if finding.within is False]
        assert [finding.what.split()[0] for finding in outside] == [device]
    with bench(tmp_path) as mended:
        assert mended.call("devices").steps["devices"].status is Status.DONE
