"""Every way out of a commissioning: interrupted, unplugged, refused, and continued."""

from collections.abc import Callable
from pathlib import Path

import pytest

from drivers.errors import DriverError
from hil.commission.state import Status
from hil.commission.step import StepContext
from hil.errors import RunAborted
from hil.orders import runner
from hil.recording import read_table
from hil.rig.drive import CycleProgress
from hil.rig.experiments.base import Phase
from hil.rig.stop import StopRequest
from tests.chosen import campaign
from tests.commission.rigs import Bench, bench
from tests.rig.observer import assert_disarmed

SHORT = (("duration_s = 30.0", "duration_s = 6.0"), ("speed_rad_s = 60.0", "speed_rad_s = 6.0"))
DRIVEN = ("noise", "signs", "scales", "friction", "prbs", "experiments")


def stops_at(stop: StopRequest, at_s: float) -> CycleProgress:
    """Press Ctrl-C when the measured part of a run is so old [s]."""

    def show(phase: Phase, time_s: float) -> None:
        if phase is Phase.MEASURE and time_s >= at_s:
            stop.request()

    return show


@pytest.fixture
def press(monkeypatch: pytest.MonkeyPatch) -> Callable[[Bench], None]:
    """Have Ctrl-C pressed in the first run of the next call of a bench."""

    def arrange(rig: Bench) -> None:
        stops: list[StopRequest] = []
        make_job = rig.job

        def remembered() -> StopRequest:
            stops.append(StopRequest())
            return stops[-1]

        def job() -> StepContext:
            made = make_job()
            from contextlib import nullcontext

            conditions = made.runner.conditions
            pressing = runner.Conditions(
                conditions.pace,
                conditions.pacer,
                conditions.scheduling,
                lambda plan: nullcontext(stops_at(stops[-1], 0.5)),
            )
            made.runner = runner.Runner(made.source, made.folder, pressing)
            return made

        monkeypatch.setattr(runner, "StopRequest", remembered)
        monkeypatch.setattr(rig, "job", job)

    return arrange


@pytest.mark.parametrize(
    "step", [pytest.param(step, marks=() if step in ("signs", "prbs") else pytest.mark.campaign) for step in DRIVEN]
)
def test_interrupted_in_the_middle_it_disarms_and_resumes_there(
    step: str, tmp_path: Path, press: Callable[[Bench], None]
) -> None:
    with bench(tmp_path, changes=SHORT) as rig:
        press(rig)
        with pytest.raises(KeyboardInterrupt):
            rig.call(step)
        assert_disarmed(rig.server.bus_url, 1, 2)
    from hil.commission.engine import NAMES
    from hil.commission.state import load_state

    state = load_state(rig.folder, NAMES)
    assert state is not None
    record = state.steps[step]
    assert record.status is Status.INTERRUPTED
    assert "Ctrl-C" in record.because
    (run,) = record.runs
    assert not run.whole
    assert run.recording is not None
    assert 0.4 < read_table(rig.folder / run.recording).columns["time_s"][-1] < 0.6
    settled = [name for name in NAMES if state.steps[name].status.is_settled]
    assert settled == list(NAMES[: NAMES.index(step)])


@pytest.mark.campaign
def test_after_an_interruption_whole_runs_are_kept_and_the_rest_is_driven(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with bench(tmp_path) as rig:
        drive, driven = runner.Runner.run, []

        def second_time_lucky(self: runner.Runner, step: str, order: object, *rest: object) -> object:
            driven.append(order.name)  # type: ignore[attr-defined]
            if driven == ["m1", "m2"]:
                raise RunAborted("PLC: permissive is withdrawn")
            return drive(self, step, order, *rest)  # type: ignore[arg-type]

        monkeypatch.setattr(runner.Runner, "run", second_time_lucky)
        with pytest.raises(RunAborted):
            rig.call("signs")
        state = rig.call("signs")
    assert driven == ["m1", "m2", "m2"]
    record = state.steps["signs"]
    assert (record.status, record.attempt) == (Status.DONE, 2)
    assert record.history[0].because == "RunAborted: PLC: permissive is withdrawn"


@pytest.mark.parametrize(
    ("fault", "error", "reported"),
    [
        ("plc.permissive_withdrawn@3.0", RunAborted, "permissive is withdrawn"),
        campaign(("m1.fault@3.0", DriverError, "inverter m1")),
        campaign(("m2.hang@3.0", RunAborted, "cut the power of the drive named")),
    ],
)
def test_lost_permission_or_device_ends_it_at_zero_torque(
    fault: str, error: type[Exception], reported: str, tmp_path: Path
) -> None:
    with bench(tmp_path, faults=[fault]) as rig:
        with pytest.raises(error, match=reported):
            rig.call("signs")
        record = rig.job().state.steps["signs"]
        torque = rig.server.torque_nm
    assert record.status is Status.INTERRUPTED
    assert reported in record.because
    assert torque == (0.0, 0.0) or "cut the power" in record.because  # a drive that hangs can't be ordered anything


@pytest.mark.campaign
def test_speed_outside_its_band_ends_the_run(tmp_path: Path) -> None:
    with bench(tmp_path, miswired=True) as rig:  # the signs were skipped: the speed control drives away with m2
        with pytest.raises(RunAborted, match=r"speed band: the speed is -?\d+\.\d rad/s, expected"):
            rig.call("scales")
        assert_disarmed(rig.server.bus_url, 1, 2)
        assert rig.job().state.steps["scales"].status is Status.INTERRUPTED


"""What is lost after two seconds of simulated time, and what has to be named."""

"""CANopen node that is still there when an inverter is lost."""

"""Every device in every step is a campaign; this one leaves both drives to themselves."""


@pytest.mark.parametrize(
    ("fault", "device"),
    [
        ("m1.absent", "m1"),
        pytest.param("m2.absent", "m2", marks=pytest.mark.campaign),
        campaign(("plc.hang@0.0", "plc")),
    ],
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
