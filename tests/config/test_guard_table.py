"""Defaults of what may come back: shares of the rated torques, the period, the drive's own slope."""

import math
from pathlib import Path

import pytest

from drivers.torque_guard import ErrorLimits
from hil.config.rig_file import Rig, read_rig
from hil.errors import RigFileError

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"


def rig_with(folder: Path, *changes: tuple[str, str]) -> Rig:
    text = EXAMPLE.read_text("utf-8")
    for before, after in changes:
        assert before in text
        text = text.replace(before, after, 1)
    path = folder / "rig.toml"
    path.write_text(text, "utf-8")
    return read_rig(path)


def error_of(folder: Path, *changes: tuple[str, str]) -> ErrorLimits:
    return rig_with(folder, *changes).guard_limits.error


def given(keys: str) -> tuple[str, str]:
    return "[guard] ", f"[guard]\n{keys}\n# "


def test_each_inverter_has_its_own_share_of_its_rated_torque(tmp_path: Path) -> None:
    error = error_of(tmp_path, ("rated_torque_nm = 600.0 ", "rated_torque_nm = 500.0 "))
    assert (error.m1_nm, error.m2_nm, error.sum_nm) == (25.0, 30.0, math.hypot(25.0, 30.0))


def test_what_the_rig_file_says_holds(tmp_path: Path) -> None:
    keys = "torque_error_nm = 7.0\ntorque_error_sum_nm = 9.0\ntorque_error_time_s = 0.2\ntorque_response_s = 0.05"
    assert error_of(tmp_path, given(keys)) == ErrorLimits(7.0, 7.0, 9.0, 0.2, 0.05)
    limits = rig_with(tmp_path, given("speed_limit_rad_s = 90.0\npermissive_timeout_s = 0.5")).guard_limits
    assert (limits.speed_limit_rad_s, limits.permissive_timeout_s) == (90.0, 0.5)


@pytest.mark.parametrize(("period_s", "response_s"), [(0.002, 0.01), (0.01, 0.01), (0.05, 0.05)])
def test_a_drive_has_one_period_and_ten_milliseconds_at_least(
    tmp_path: Path, period_s: float, response_s: float
) -> None:
    assert error_of(tmp_path, ("period_s = 0.01 ", f"period_s = {period_s} ")).response_s == response_s


@pytest.mark.parametrize(
    "change",
    [
        (
            ("# torque_slope_nm_per_s = 5000.0 ", "torque_slope_nm_per_s = 2400.0 "),
            ('mode = "cyclic_synchronous_torque" ', 'mode = "profile_torque" '),
        ),
        (('source = "host"', 'source = "plc"'),),
    ],
    ids=["slow slope", "PRBS by the PLC"],
)
def test_what_is_predicted_widens_no_limit(tmp_path: Path, change: tuple[tuple[str, str], ...]) -> None:
    assert error_of(tmp_path, *change) == error_of(tmp_path)


@pytest.mark.parametrize(
    ("keys", "named"),
    [
        ("torque_error_nm = 0.0", "guard.torque_error_nm"),
        ("torque_error_sum_nm = -1.0", "guard.torque_error_sum_nm"),
        ("torque_error_time_s = 0.0", "guard.torque_error_time_s"),
        ("torque_error_time_s = 1.1", "guard.torque_error_time_s"),
        ("torque_response_s = 0.0", "guard.torque_response_s"),
        ("torque_response_s = 10.1", "guard.torque_response_s"),
        ("permissive_timeout_s = 0.0", "guard.permissive_timeout_s"),
        ("speed_limit_rad_s = 0.0", "guard.speed_limit_rad_s"),
    ],
)
def test_a_limit_that_limits_nothing_is_refused_by_its_key(tmp_path: Path, keys: str, named: str) -> None:
    with pytest.raises(RigFileError, match=named):
        rig_with(tmp_path, given(keys))


def test_the_largest_times_are_taken(tmp_path: Path) -> None:
    error = error_of(tmp_path, given("torque_error_time_s = 1\ntorque_response_s = 10"))
    assert (error.time_s, error.response_s) == (1.0, 10.0)


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ("host_node_id = 1", "can.host_node_id | expected another node id than 1, 2"),
        ("monitor_node_id = 2", "can.monitor_node_id | expected another node id than 1, 2"),
        ("host_node_id = 9\nmonitor_node_id = 9", "can.monitor_node_id | expected another node id than 1, 2, 9"),
    ],
)
def test_every_node_has_an_id_of_its_own(tmp_path: Path, keys: str, problem: str) -> None:
    with pytest.raises(RigFileError) as refusal:
        rig_with(tmp_path, ("[can]\n", f"[can]\n{keys}\n"))
    assert problem in str(refusal.value)


@pytest.mark.parametrize(("period_s", "deadline_ms"), [(0.01, 150), (0.06, 150), (0.1, 250)])
def test_the_deadline_of_commands_grows_with_the_period(tmp_path: Path, period_s: float, deadline_ms: int) -> None:
    rig = rig_with(tmp_path, ("period_s = 0.01 ", f"period_s = {period_s} "))
    assert rig.rpdo_deadline_ms(rig.inverters.m1) == deadline_ms
