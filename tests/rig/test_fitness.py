"""Every single thing that speaks against driving is named, and nothing else."""

from dataclasses import replace

import pytest

from drivers.plc.types import ClutchState, DriveMode, PlcStatus, PrbsSettings, PrbsSource
from hil.rig.plc_watch import Needs, changes, reasons_against

FIT = PlcStatus(
    drive_mode=DriveMode.SERIES,
    clutch=ClutchState.OPEN,
    permissive=True,
    speed_limit_rad_s=300.0,
    torque_limit_nm=400.0,
    plc_count=0,
    prbs=PrbsSettings(False, 0.0, 1, 1, PrbsSource.HOST),
    prbs_torque_nm=0.0,
    t_ns=0,
)
NEEDS = Needs(400.0)


@pytest.mark.parametrize("mode", [DriveMode.SERIES, DriveMode.ELECTRIC])
def test_fit_vehicle(mode: DriveMode) -> None:
    status = replace(FIT, drive_mode=mode)
    assert list(reasons_against(status, NEEDS)) == []
    assert list(changes(status, status, NEEDS)) == []


@pytest.mark.parametrize(
    ("status", "reason"),
    [
        (replace(FIT, drive_mode=DriveMode.PARALLEL), "drive mode is parallel, expected series or electric"),
        (replace(FIT, clutch=ClutchState.CLOSED), "clutch is closed, expected open"),
        (replace(FIT, permissive=False), "permissive is withdrawn, expected present"),
    ],
)
def test_each_reason_alone(status: PlcStatus, reason: str) -> None:
    assert list(reasons_against(status, NEEDS)) == [reason]
    assert list(changes(FIT, status, NEEDS)) == [reason]


def test_torque_limit_below_what_the_run_needs() -> None:
    (reason,) = reasons_against(replace(FIT, torque_limit_nm=399.9), NEEDS)
    assert "399.9 Nm" in reason
    assert "400 Nm" in reason
