"""Whole runs on the real protocol stacks: what is recorded when nothing goes wrong."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from hil.config.rig_file import PrbsTarget, Rig
from hil.rig.build import open_devices
from hil.rig.experiments.base import Phase
from hil.sample import SampleFlag
from tests.rig.observer import assert_disarmed
from tests.rig.serving import DRAG_NM_S, DURATION_S, INERTIA_KG_M2, Samples, changed, run, run_once, served, small_rig

HALF_COUNT_NM = 0.5 * 600.0 / 1000.0
"""Half of an inverter's torque count: 0.1 % of 600 Nm."""


@dataclass
class Cruise:
    """One run that several tests look at."""

    rig: Rig
    samples: Samples = field(default_factory=Samples)
    phases: list[Phase] = field(default_factory=list)
    plc: dict[str, object] = field(default_factory=dict)


@pytest.fixture(scope="module")
def cruise() -> Cruise:
    """Drive a cruise, with the PLC's generator on before it."""
    with served() as (server, rig):
        made = Cruise(rig)
        server.plc.write({"prbs_enable": True, "prbs_source": "plc", "prbs_amplitude": 50.0})
        summary = run_once(rig, made.samples, progress=lambda phase, time_s: made.phases.append(phase))
        assert_disarmed(server.bus_url, 1, 2)
        made.plc.update(server.plc.values())
    assert len(made.samples.rows) == summary.recorded
    assert summary.flagged == 0
    return made


def test_records_the_measured_part(cruise: Cruise) -> None:
    samples = cruise.samples
    assert len(samples.rows) == round(DURATION_S / cruise.rig.period_s)
    assert samples.column("time_s") == [k / 100 for k in range(100)]
    assert set(samples.column("flags")) == {SampleFlag.GOOD}
    assert set(samples.column("age_ns")) == {0}
    assert list(dict.fromkeys(cruise.phases)) == [Phase.APPROACH, Phase.MEASURE, Phase.RELEASE, Phase.DONE]
    assert cruise.phases.count(Phase.MEASURE) == 100


def test_row_holds_the_torque_that_acts_from_its_time_on(cruise: Cruise) -> None:
    samples = cruise.samples
    for inverter in ("m1", "m2"):
        wanted = np.array(samples.column(f"torque_ref_{inverter}_nm"))
        given = np.array(samples.column(f"torque_{inverter}_nm"))
        # base and PRBS travel in one object each, so each is rounded to a count
        assert np.abs(given - wanted).max() <= 2 * HALF_COUNT_NM + 1e-9
    torque = np.array(samples.column("torque_m1_nm")) + np.array(samples.column("torque_m2_nm"))
    speed = np.array(samples.column("speed_rad_s"))
    step = cruise.rig.period_s * (torque - DRAG_NM_S * speed) / INERTIA_KG_M2
    assert np.diff(speed) == pytest.approx(step[:-1], abs=1e-3)


@pytest.mark.parametrize(("target", "carrier"), [(PrbsTarget.M1, "torque_m1_nm"), (PrbsTarget.M2, "torque_m2_nm")])
def test_prbs_rides_on_the_inverter_that_is_named(target: PrbsTarget, carrier: str) -> None:
    samples = Samples()
    rig = changed(small_rig(), {"prbs": {"target": target}})
    with served(rig) as (_, rig):
        run_once(rig, samples)
    prbs = np.array(samples.column("prbs_nm"))
    for column in ("torque_m1_nm", "torque_m2_nm"):
        torque = np.array(samples.column(column))
        share = np.polyfit(prbs, torque, 1)[0]
        assert share == pytest.approx(1.0 if column == carrier else 0.0, abs=0.1)


def test_same_rig_and_seed_give_the_same_recording() -> None:
    noise = {"simulation": {"speed_noise_rad_s": 0.05, "torque_noise_permille": 1.0}}
    runs = []
    for _ in range(2):
        samples = Samples()
        with served(changed(small_rig(), noise)) as (_, rig):
            run_once(rig, samples, experiment="reversal")
        runs.append([replace(row, t_ns=0) for row in samples.rows])
    assert runs[0] == runs[1]


def test_two_runs_on_the_same_opened_rig() -> None:
    first, second = Samples(), Samples()
    with served() as (server, rig), open_devices(rig) as devices:
        run(rig, devices, first)
        run(rig, devices, second, experiment="reversal")
        assert_disarmed(server.bus_url, 1, 2)
    assert len(first.rows) == len(second.rows) == 100
