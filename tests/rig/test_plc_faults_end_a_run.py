"""A PLC that fails while torque is on the shaft: the run ends disarmed, and says what the PLC did."""

from __future__ import annotations

import pytest

from drivers.errors import DriverError
from drivers.plc.plc import Plc
from hil.errors import RunAborted
from hil.rig.experiments.base import Phase
from hil.simulator.fault_table import rig_faults
from hil.simulator.rig_server import HOST_TIMEOUT_S
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, changed, fast, run_once, served, small_rig


@pytest.fixture(scope="module")
def in_the_middle() -> str:
    """Moment in the middle of the measured part, as a fault is written, from a run in which nothing goes wrong."""
    samples = Samples()
    with served() as (_, rig):
        run_once(rig, samples, experiment="reversal")
    return f"@{samples.rows[len(samples.rows) // 2].cycle * rig.period_s:.2f}"


@pytest.mark.parametrize(
    ("fault", "named"),
    [
        ("exception", r"got exception 4 \(server device failure: the PLC could not do it\)"),
        ("slow", r"expected an answer within 1 s, none came|no answer for 1\.\d\d s"),
        ("half_answer", r"expected an answer within 1 s, only \d+ bytes came that are no whole one"),
        ("reset", r"expected an answer, the connection was lost"),
        ("wrong_width", r"reading \d+ \w+\(s\) from address \d+: expected \d+ values, got \d+"),
    ],
)
def test_it_ends_the_run_at_zero_torque(fault: str, named: str, in_the_middle: str) -> None:
    samples = Samples()
    faults = rig_faults([f"plc.{fault}{in_the_middle}"], period_s=0.01)
    with served(faults=faults) as (server, rig):
        with pytest.raises(RunAborted, match=rf"^PLC: .*({named})"):
            run_once(rig, samples, experiment="reversal", pacer=fast(rig, answer_timeout_s=5.0))
        assert_disarmed(server.bus_url, 1, 2)
    assert 0 < len(samples.rows) < 100


@pytest.mark.parametrize("fault", ["exception", "half_answer"])
def test_from_the_start_on_nothing_is_armed(fault: str) -> None:
    samples = Samples()
    with served(faults=rig_faults([f"plc.{fault}@0"], period_s=0.01)) as (server, rig):
        with pytest.raises(DriverError, match=r"^PLC at 127"):
            run_once(rig, samples)
        assert_disarmed(server.bus_url, 1, 2)
    assert samples.rows == []


def test_a_host_whose_beats_stop_loses_the_permissive(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cycle continues and reads the PLC, but its watchdog stands still, from the measured part on."""
    stopped: list[bool] = []
    beat = Plc.beat

    async def beat_until_stopped(plc: Plc) -> None:
        if not stopped:
            await beat(plc)

    def stop(phase: Phase, time_s: float) -> None:
        if phase is Phase.MEASURE:
            stopped.append(True)

    monkeypatch.setattr(Plc, "beat", beat_until_stopped)
    long = changed(small_rig(), {"experiments.reversal": {"duration_s": 2.0 * HOST_TIMEOUT_S}})
    with served(long) as (server, rig):
        with pytest.raises(RunAborted, match="permissive is withdrawn, expected present"):
            run_once(rig, Samples(), progress=stop, experiment="reversal")
        assert_disarmed(server.bus_url, 1, 2)
        assert server.plc.values()["permissive"] is False
