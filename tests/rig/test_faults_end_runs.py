"""Faults as ``hil sim --fault`` takes them, in a run: it ends at zero torque and says why, or samples are flagged.

Those of drives that hang, fault or are another from the start are looked at in ``test_session_ends_early.py``.
"""

import time
from typing import Any

import pytest

from drivers.errors import BusDown, DeviceTimeout, WrongTorque
from hil.errors import RunAborted
from hil.rig.drive import RunSummary
from hil.sample import SampleFlag
from hil.simulator.fault_table import rig_faults
from hil.simulator.rig_server import RigServer
from tests.chosen import one_in
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, fast, run_once, served, small_rig


@pytest.fixture(scope="module")
def within_s() -> float:
    """A moment of simulated time in the middle of the measured part of the small rig's reversal."""
    rig, samples = small_rig(), Samples()
    with served(rig) as (_, connected):
        run_once(connected, samples, experiment="reversal")
    return samples.rows[50].cycle * rig.period_s


def faulty(*texts: str) -> Any:
    rig = small_rig()
    return served(rig, rig_faults(texts, rig.period_s))


def run_with(*texts: str, patience_s: float = 0.1) -> tuple[RunSummary, Samples]:
    """Run, if with faults then with such as do not end it; each answer that is lost costs the patience."""
    samples = Samples()
    with faulty(*texts) as (server, rig):
        summary = run_once(rig, samples, experiment="reversal", pacer=fast(rig, patience_s))
        assert_disarmed(server.bus_url, 1, 2)
    return summary, samples


@pytest.fixture(scope="module")
def clean() -> Samples:
    """The same run without a fault."""
    return run_with()[1]


@pytest.fixture(scope="module")
def lossy() -> tuple[RunSummary, Samples]:
    """A run in which a tenth of the first drive's answers is lost."""
    return run_with("bus.lose=0.1:0x181")


def assert_torque_ends(server: RigServer, within_s: float = 60.0) -> None:
    deadline_s = time.monotonic() + within_s
    while server.torque_nm != (0.0, 0.0):
        assert time.monotonic() < deadline_s, f"torque is still {server.torque_nm}"
        time.sleep(0.01)


def test_drive_that_leaves_the_bus_has_no_torque_and_the_other_is_disarmed(within_s: float) -> None:
    with faulty(f"m1.bus_off@{within_s}") as (server, rig):
        with pytest.raises(RunAborted, match=r"not every drive.*inverter m1") as caught:
            run_once(rig, Samples(), experiment="reversal", pacer=fast(rig, answer_timeout_s=0.1))
        assert_disarmed(server.bus_url, 2)
        assert server.torque_nm == (0.0, 0.0)
    assert isinstance(caught.value.__cause__, DeviceTimeout)


def test_host_that_is_off_the_bus_disarms_nobody_but_the_drives_miss_it(within_s: float) -> None:
    """The last resort: nothing the host sends arrives, and both drives stop for want of its heartbeat."""
    with faulty(f"bus.off@{within_s}") as (server, rig):
        with pytest.raises(RunAborted, match=r"not every drive.*bus-off.*cut the power") as caught:
            run_once(rig, Samples(), experiment="reversal")
        assert_torque_ends(server)
    assert isinstance(caught.value.__cause__, BusDown)


def test_lost_answers_are_flagged_and_the_run_continues(lossy: tuple[RunSummary, Samples]) -> None:
    summary, samples = lossy
    stale = [row for row in samples.rows if row.flags is SampleFlag.M1_STALE]
    assert summary.recorded == 100
    assert 2 <= len(stale) <= 25  # 100 draws of 0.1: outside with a chance below 1e-4
    assert summary.flagged == len(stale)


@pytest.mark.parametrize("fault", one_in(3, ["bus.reorder=0.2:0x181", "bus.delay=0.002", "bus.jitter=0.002"]))
def test_frames_that_come_late_within_the_patience_change_nothing(fault: str, clean: Samples) -> None:
    late = run_with(fault, patience_s=5.0)[1]
    for name in ("torque_m1_nm", "torque_m2_nm", "speed_rad_s", "flags"):
        assert late.column(name) == clean.column(name)


@pytest.mark.parametrize(
    ("fault", "changes", "remark"),
    [
        ("m1.coarse_torque=20", "torque_m1_nm", SampleFlag.GOOD),
        ("m2.weak_cooling=20", "torque_m2_nm", SampleFlag.M2_LIMITED),
        ("m1.field_weakening=1", "torque_m1_nm", SampleFlag.M1_LIMITED),
        ("m1.clock_drift=5000", "speed_rad_s", SampleFlag.GOOD),
    ],
)
def test_limits_of_a_drive_are_seen_in_what_it_tells(
    fault: str, changes: str, remark: SampleFlag, clean: Samples
) -> None:
    """A sample in which a limit acts is flagged, and counts: its torque was read."""
    limited = run_with(fault)[1]
    assert limited.column(changes) != clean.column(changes)
    assert {row.flags for row in limited.rows} <= {SampleFlag.GOOD, remark}
    assert remark in {row.flags for row in limited.rows}
    assert all(row.counts for row in limited.rows)


FROM_S = 4.3
"""In the middle of the measured part."""

NOTICED_S = 0.3

TOGETHER = "both inverters: torque actual value"


@pytest.mark.parametrize(
    ("faults", "named"),
    [
        (["m1.torque_gain@{}=2"], "inverter m1: torque actual value"),
        (["m1.torque_offset@{}=45", "m2.torque_offset@{}=45"], TOGETHER),
    ],
)
def test_a_wrong_torque_ends_the_run_in_time(faults: list[str], named: str) -> None:
    rig = small_rig()
    specs = [each.format(FROM_S) for each in faults]
    seen: list[float] = []
    with served(rig, rig_faults(specs, rig.period_s)) as (server, at):
        with pytest.raises(WrongTorque, match=named):
            run_once(at, Samples(), progress=lambda phase, time_s: seen.append(server.plc.values()["plc_count"]))
        assert_disarmed(server.bus_url, 1, 2)
        assert server.torque_nm == (0.0, 0.0)
        assert float(server.plc.values()["plc_count"]) * rig.period_s <= FROM_S + NOTICED_S


def test_a_torque_nobody_asked_for_ends_it_before_the_guard_is_enabled() -> None:
    rig = small_rig()
    samples = Samples()
    with served(rig, rig_faults(["m1.torque_offset@0=800"], rig.period_s)) as (server, at):
        with pytest.raises(WrongTorque, match=r"inverter m1: .* is 480 Nm, expected"):
            run_once(at, samples)
        assert_disarmed(server.bus_url, 1, 2)
    assert samples.rows == []


@pytest.mark.parametrize("fault", one_in(2, ["m2.stale_share=0.3", "m1.coarse_torque=10", "m2.clock_drift=200"]))
def test_what_a_healthy_drive_does_is_recorded(fault: str) -> None:
    """A drive that is slow, coarse, or samples by a clock of its own."""
    rig = small_rig()
    samples = Samples()
    with served(rig, rig_faults([fault], rig.period_s)) as (_, at):
        assert run_once(at, samples).recorded > 0
