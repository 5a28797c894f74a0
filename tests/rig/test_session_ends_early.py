"""Runs that something ends: the reason is named, the drives are disarmed, what was recorded stays."""

from collections.abc import Callable

import pytest

from drivers.errors import DeviceTimeout
from drivers.plc.types import DriveMode
from hil.errors import RunAborted
from hil.rig.build import open_devices
from hil.rig.drive import CycleProgress
from hil.rig.experiments.base import Phase
from hil.rig.stop import StopRequest
from hil.simulator.faults import InverterFaults, RigFaults
from hil.simulator.plc_device import PlcDevice, PlcSetup
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, fast, run, run_once, served

STEP_WITHIN = 250
"""A SYNC inside the measured part of the small rig's reversal, which is SYNC 200 to 300 or so."""


def in_the_middle(action: Callable[[], None]) -> CycleProgress:
    """Do something half a second into the measured part."""

    def show(phase: Phase, time_s: float) -> None:
        if phase is Phase.MEASURE and time_s == 0.5:
            action()

    return show


def test_vehicle_faster_than_the_plc_permits_ends_the_run() -> None:
    slow = PlcDevice(PlcSetup(speed_limit_rad_s=0.1))
    with served(plc=slow) as (server, rig):
        with pytest.raises(RunAborted, match=r"speed is -?[01]\.\d and -?[01]\.\d rad/s, expected at most 0\.1 rad/s"):
            run_once(rig, Samples())
        assert_disarmed(server.bus_url, 1, 2)


@pytest.mark.parametrize(
    ("plc", "named"),
    [
        (PlcDevice(PlcSetup(drive_mode=DriveMode.PARALLEL)), "drive mode is parallel"),
        (PlcDevice(PlcSetup(torque_limit_nm=200.0)), r"torque limit of one inverter is 200 Nm.*310 Nm"),
    ],
)
def test_vehicle_that_is_not_fit_is_not_armed(plc: PlcDevice, named: str) -> None:
    samples = Samples()
    with served(plc=plc) as (server, rig):
        with pytest.raises(RunAborted, match=f"{named}.*Nothing was armed"):
            run_once(rig, samples)
        assert_disarmed(server.bus_url, 1, 2)
    assert samples.rows == []


@pytest.mark.parametrize(("hung", "other"), [("m1", 2), pytest.param("m2", 1, marks=pytest.mark.campaign)])
def test_inverter_that_hangs_does_not_keep_the_other_armed(hung: str, other: int) -> None:
    samples = Samples()
    faults = RigFaults(**{hung: InverterFaults(hang_at_step=STEP_WITHIN)})
    with served(faults=faults) as (server, rig):
        with pytest.raises(RunAborted, match=rf"not every drive.*inverter {hung}.*What ended the run") as caught:
            run_once(rig, samples, experiment="reversal", pacer=fast(rig, answer_timeout_s=0.1))
        assert_disarmed(server.bus_url, other)
    assert isinstance(caught.value.__cause__, DeviceTimeout)
    stale = [row for row in samples.rows if row.flags]
    assert stale
    assert {row.flags.name for row in stale} == {f"{hung.upper()}_STALE"}
    assert [row.age_ns for row in stale] == [10_000_000 * (k + 1) for k in range(len(stale))]


@pytest.mark.parametrize("deaf", [pytest.param("m1", marks=pytest.mark.campaign), "m2"])
def test_one_request_lost_at_the_end_is_made_again(deaf: str, monkeypatch: pytest.MonkeyPatch) -> None:
    samples, lost = Samples(), []
    with served() as (server, rig), open_devices(rig) as devices:
        client = getattr(devices, deaf)._sdo._client
        send = client.send_request

        def lose_the_first(request: bytes) -> None:
            if lost:
                send(request)
            lost.append(request)

        run(
            rig,
            devices,
            samples,
            progress=in_the_middle(lambda: monkeypatch.setattr(client, "send_request", lose_the_first)),
        )
        assert len(lost) > 1
        assert_disarmed(server.bus_url, 1, 2)
    assert len(samples.rows) == 100


def test_stop_request_ends_the_run_and_keeps_the_samples() -> None:
    samples, stop = Samples(), StopRequest()
    with served() as (server, rig):
        with pytest.raises(KeyboardInterrupt):
            run_once(rig, samples, stop=stop, progress=in_the_middle(stop.request))
        assert_disarmed(server.bus_url, 1, 2)
    assert len(samples.rows) == 51


def test_recorder_that_fails_disarms_too() -> None:
    class FullDisk(Samples):
        def append(self, sample: object) -> None:
            raise OSError(28, "No space left on device")

    with served() as (server, rig):
        with pytest.raises(OSError, match="No space left"):
            run_once(rig, FullDisk())
        assert_disarmed(server.bus_url, 1, 2)
