"""Further channels of a rig file: mapped, read, recorded and checked over the real protocols."""

from pathlib import Path

import numpy as np
import pytest

from hil.config.rig_file import read_rig
from hil.errors import RigFileError
from hil.recording import RecordingWriter, read_table
from hil.recording.signals import read_record
from hil.recording.signals_config import SignalsConfig
from hil.rig.build import open_devices
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.simulator.driveline import simulation_model
from hil.simulator.rig_server import required_simulation
from tests.rig.sensed import CHANNELS, sensed_rig, served_with_sensors, write_rig
from tests.rig.serving import Samples, fast, run_once

OUTPUTS = SignalsConfig.model_validate(
    {
        "outputs": [
            {"kind": "speed", "at": "motor", "column": "speed_rad_s"},
            {"kind": "speed", "at": "load", "column": "speed_load_rad_s"},
            {"kind": "torque", "at": "shaft", "column": "torque_shaft_nm"},
        ]
    }
)


def test_a_run_records_each_channel_in_si_units(tmp_path: Path) -> None:
    rig, path = sensed_rig(tmp_path), tmp_path / "run.csv"
    with served_with_sensors(rig) as at, open_devices(at) as devices:
        plan = plan_run(at, "reversal")
        with RecordingWriter(path, channel_units=at.channel_units) as recorder:
            run_plan(devices, plan, fast(at), recorder, StopRequest(), lambda phase, time_s: None)
    table = read_table(path)
    assert {name: table.units[name] for name in at.channel_units} == at.channel_units
    read = table.numeric([*at.channel_units, "speed_rad_s", "torque_m1_nm", "torque_m2_nm", "flags"])
    assert set(read["flags"]) == {0.0}
    line = simulation_model(required_simulation(rig)).values()
    torque = read["torque_m1_nm"] + read["torque_m2_nm"]
    motor, shaft, pulling = read["speed_rad_s"][1:], read["torque_shaft_nm"][1:], torque[:-1]
    due = (pulling - shaft - line["b_M"] * motor) / line["J_M"]  # the row's torque acts from then on
    assert np.ptp(due) > 100.0
    np.testing.assert_allclose(read["accel_rad_s2"][1:], due, atol=1.0)  # a count of the shaft's torque is 0.1 Nm
    load = read["speed_load_rad_s"]
    np.testing.assert_allclose(load, np.round(load, 3), atol=1e-9)  # a count is 0.001 rad/s
    due = load[0] + np.cumsum(shaft - line["b_L"] * load[1:]) * rig.period_s / line["J_L"]
    np.testing.assert_allclose(load[1:], due, atol=0.05)
    record = read_record(path, OUTPUTS)
    assert [channel.label for channel in record.channels] == ["speed_load_rad_s", "torque_shaft_nm"]
    assert all(channel.okay.all() for channel in record.channels)


def test_a_channel_is_that_of_the_sync_of_its_row(tmp_path: Path) -> None:
    samples = Samples()
    at_motor = CHANNELS.replace('at = "load"', 'at = "motor"')
    with served_with_sensors(sensed_rig(tmp_path, at_motor)) as at:
        run_once(at, samples, experiment="reversal")
    motor, second = samples.column("speed_rad_s"), [row.channels[0] for row in samples.rows]
    assert np.ptp(motor) > 1.0
    np.testing.assert_allclose(second, motor, atol=0.0015)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("object = 0x2100", "object = 0x2101", r"channels\.2\.object \| .*0x2101.*is not there"),
        ("object = 0x2100", "object = 0x6502", r"channels\.2\.object \| .*0x6502 has PDOMapping=0"),
        ('"acceleration"\n\n', '"accel"\n\n', r"channels\.1\.register \| expected one of the registers.*got 'accel'"),
        ('"acceleration"\n\n', '"speed_limit"\n\n', r"channels\.1\.register \| .*in rad/s\^2.*got one in rad/s$"),
        ('"acceleration"\n\n', '"permissive"\n\n', r"channels\.1\.register \| .*holds a number.*of type bool"),
        ("subindex = 1\nscale = 0.001", "subindex = 1", r"channels\.0\.scale \| expected this key next to object"),
        ('inverter = "m2"\nobject = 0x2100', 'register = "acceleration"\nobject = 0x2100', r"channels\.2 \| .*either"),
        ('"torque_shaft_nm"', '"torque_shaft"', r"channels\.2\.column \| expected a name that ends in _nm"),
        ('"torque_shaft_nm"', '"torque_m1_nm"', r"channels\.2\.column \| .*every recording has"),
        ('at = "shaft"', 'at = "motor"', r"channels\.2\.kind \| .*got 'torque at the motor'"),
        ("scale = 0.1", "scale = 0.0", r"channels\.2\.scale \| expected a number of 1e-12 to 1e\+12"),
        ("scale = 0.1", "scale = 1e300", r"channels\.2\.scale \| expected a number of 1e-12 to 1e\+12"),
        (
            'register = "acceleration"',
            'register = "acceleration"\nsubindex = 3',
            r"channels\.1\.subindex \| .*register",
        ),
        ('column = "accel_rad_s2"', 'column = "Accel"', r"channels\.1\.column"),
    ],
)
def test_a_channel_that_can_not_be_is_refused_with_its_key(tmp_path: Path, old: str, new: str, expected: str) -> None:
    assert CHANNELS.count(old) == 1
    path = write_rig(tmp_path, CHANNELS.replace(old, new))
    with pytest.raises(RigFileError, match=expected) as refusal:
        read_rig(path)
    assert str(path) in str(refusal.value)


def test_a_drive_without_a_free_tpdo_is_refused_before_anything_is_connected(tmp_path: Path) -> None:
    with pytest.raises(RigFileError, match=r"channels\.0\.object \| .*TPDO that maps 0x60E5:01.*not used"):
        read_rig(write_rig(tmp_path, tpdos=1))
