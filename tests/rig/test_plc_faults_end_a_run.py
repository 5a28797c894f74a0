"""A PLC that fails while torque is on the shaft: the run ends disarmed, and says what the PLC did."""

import pytest

from drivers.plc.plc import Plc
from hil.errors import RunAborted
from hil.rig.experiments.base import Phase
from hil.simulator.rig_server import HOST_TIMEOUT_S
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, changed, run_once, served, small_rig


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
