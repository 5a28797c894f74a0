"""Runs whose PRBS the PLC makes: in the measured part, inside the guard's limits, off on every way out."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.errors import CommandRefused
from drivers.plc.register import Value
from drivers.plc.types import PrbsSource
from hil.config.rig_file import PrbsTarget, Rig
from hil.errors import RunAborted
from hil.rig.drive import CycleProgress
from hil.rig.experiments.base import Phase
from hil.rig.plan import plan_run
from hil.simulator.plc_device import PlcPrbs as Generator
from hil.simulator.rig_server import RigServer
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, changed, run_once, served, small_rig

AMPLITUDE_NM = 120.0
HALF_COUNT_NM = 0.5 * 600.0 / 1000.0
"""Half of an inverter's torque count: 0.1 % of 600 Nm."""


def plc_rig(**prbs: Any) -> Rig:
    rig: Rig = changed(small_rig(), {"prbs": {"source": PrbsSource.PLC, **prbs}})
    return rig


def generator_of(server: RigServer) -> dict[str, Value]:
    values = server.plc.values()
    return {name: values[name] for name in ("prbs_enable", "prbs_source", "prbs_amplitude", "prbs_torque")}


OFF: dict[str, Value] = {"prbs_enable": False, "prbs_source": "host", "prbs_amplitude": 0.0, "prbs_torque": 0.0}


def half_way(action: Callable[[], object]) -> CycleProgress:
    def show(phase: Phase, time_s: float) -> None:
        if phase is Phase.MEASURE and time_s == 0.5:
            action()

    return show


def beyond_the_host(samples: Samples, inverter: str) -> np.ndarray:
    """Torque of an inverter that the host did not ask for [Nm]."""
    given, asked = samples.column(f"torque_{inverter}_nm"), samples.column(f"torque_ref_{inverter}_nm")
    return np.array(given) - np.array(asked)


@pytest.mark.parametrize(
    ("target", "share_m1", "part_m1"),
    [
        (PrbsTarget.BOTH, None, 0.5),
        (PrbsTarget.M1, None, 1.0),
        (PrbsTarget.M2, None, 0.0),
        (PrbsTarget.SHARED, 0.25, 0.25),
    ],
)
def test_its_levels_are_on_the_shaft_shared_out_as_the_rig_file_says(
    target: PrbsTarget, share_m1: float | None, part_m1: float
) -> None:
    samples = Samples()
    with served(plc_rig(target=target, share_m1=share_m1, seed=5)) as (server, rig):
        run_once(rig, samples)
        assert_disarmed(server.bus_url, 1, 2)
        assert generator_of(server) == OFF
    expected = Generator(AMPLITUDE_NM, rig.prbs.clock_divider, rig.prbs.seed)
    levels = np.zeros(len(samples.rows))
    for k in range(len(levels)):
        levels[k] = expected.torque_nm
        expected.clock()
    assert set(levels) == {AMPLITUDE_NM, -AMPLITUDE_NM}
    for inverter, part in (("m1", part_m1), ("m2", 1.0 - part_m1)):
        assert np.abs(beyond_the_host(samples, inverter) - part * levels).max() <= 2 * HALF_COUNT_NM + 1e-9


def test_it_runs_in_the_measured_part_and_nowhere_else() -> None:
    seen: dict[Phase, set[bool]] = {}
    with served(plc_rig()) as (server, rig):

        def show(phase: Phase, time_s: float) -> None:
            seen.setdefault(phase, set()).add(server.plc.prbs_torque_nm != 0.0)

        run_once(rig, Samples(), progress=show)
    assert seen == {Phase.APPROACH: {False}, Phase.MEASURE: {True}, Phase.RELEASE: {False}, Phase.DONE: {False}}


def test_the_recording_holds_what_the_plc_reported_and_nothing_made_up() -> None:
    samples = Samples()
    with served(plc_rig(seed=5)) as (_, rig):
        run_once(rig, samples)
    reported = np.array(samples.column("prbs_nm"))
    known = np.isfinite(reported)
    assert known.sum() == 10  # ten polls in the second it takes
    on_the_shaft = beyond_the_host(samples, "m1") + beyond_the_host(samples, "m2")
    assert np.abs(reported - on_the_shaft)[known].max() <= 4 * HALF_COUNT_NM + 1e-9
    assert set(reported[known]) == {AMPLITUDE_NM, -AMPLITUDE_NM}


class TestEveryWayOut:
    def test_a_plc_that_falls_silent(self) -> None:
        with served(plc_rig()) as (server, rig):
            with pytest.raises(RunAborted, match=r"generator confirmed off, got: .*What ended the run: PLC: ") as said:
                run_once(rig, Samples(), progress=half_way(server.plc_server.pause))
            assert_disarmed(server.bus_url, 1, 2)
            assert server.plc.values()["prbs_enable"] is True
        assert "Switch it off at the PLC before the drives are armed again" in str(said.value)
        assert isinstance(said.value.__cause__, RunAborted)


class TestSomebodyElseWritesThere:
    @pytest.mark.parametrize(
        ("change", "named"),
        [
            ({"prbs_amplitude": 300.0}, "set to on, 300 Nm, .*expected on, 120 Nm, divider 2, seed 1, source plc"),
            ({"prbs_enable": False}, "set to off, expected on, 120 Nm"),
        ],
    )
    def test_while_it_runs(self, change: dict[str, Value], named: str) -> None:
        with served(plc_rig()) as (server, rig):
            with pytest.raises(RunAborted, match=named):
                run_once(rig, Samples(), progress=half_way(lambda: server.plc.write(change)))
            assert_disarmed(server.bus_url, 1, 2)
            assert generator_of(server) == OFF


class TestTheGuard:
    @pytest.mark.parametrize(
        ("table", "limit", "named"),
        [
            ("guard", {"prbs_limit_nm": 59.0}, r"inverter m1: PRBS torque is -?60 Nm, expected at most 59 Nm"),
            ("guard", {"sum_limit_nm": 119.0}, r"sum of both inverters is -?120 Nm, expected at most 119 Nm"),
            ("inverters.m2", {"torque_limit_nm": 59.0}, r"inverter m2: base \+ PRBS torque is -?60 Nm"),
        ],
    )
    def test_an_amplitude_beyond_a_limit_is_refused_before_anything_is_connected(
        self, table: str, limit: dict[str, float], named: str
    ) -> None:
        with pytest.raises(CommandRefused, match=named):
            plan_run(changed(plc_rig(), {table: limit}), "cruise")

    def test_what_the_plc_adds_is_kept_free_under_every_limit(self) -> None:
        host, plc = small_rig(), plc_rig(target=PrbsTarget.SHARED, share_m1=0.25)
        kept, full = plc.guard_limits, host.guard_limits
        assert kept.torque_limit_m1_nm == full.torque_limit_m1_nm - 30.0
        assert kept.torque_limit_m2_nm == full.torque_limit_m2_nm - 90.0
        assert kept.sum_limit_nm == full.sum_limit_nm - 120.0
        assert plc.torque_limits == full == host.torque_limits
