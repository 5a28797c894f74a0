"""Active damping in a run: its limit, what ends it, which files are refused; the same torque from what is exported."""

import ctypes
import math
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import tomlkit

from drivers.errors import CommandRefused
from estimator.identification.modes.modes import Mode
from estimator.identification.online.recursive import Status
from hil.config.damper_file import DamperFile, DesignedFor, damper_toml, drivable
from hil.errors import FileProblem, UsageError
from hil.export.damper import damper_text
from hil.rig.build import open_devices
from hil.rig.damper import Damping
from hil.rig.experiments.base import Phase
from hil.rig.live import LiveEstimate, tracking_chain
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.sample import Sample, SampleFlag
from tests.export.iec.machine import FLAGS, Machine
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, changed, fast, served, small_rig

RIG = changed(small_rig(), {"experiments.cruise": {"torque_nm": 450.0}})
LIMIT_NM = 100.0
B, A = [17.9436, -18.4801, 0.5365], [1.0, -1.0590, 0.3154]
CONTENT: dict[str, Any] = {
    "schema": "hil.damper/1",
    "model": "bus.toml",
    "period_s": 0.01,
    "dead_time_s": 0.01,
    "lag_s": 0.0,
    "region_hz": [7.4, 9.1],
    "least_damping": 0.31,
    "sensitivity": 1.4,
    "torque_nm": 100.0,
    "line": {"J_M": 1.6, "J_L": 100.0, "k": 4200.0, "c": 9.0, "b_M": 0.35, "b_L": 0.9},
    "filter": {"b": B, "a": A},
    "rig": DesignedFor.of(RIG, LIMIT_NM).model_dump(),
}
FILE = DamperFile.model_validate(CONTENT)
SAMPLE = Sample(0, 0, 0.0, 0.0, 0.0, 60.0, 0.0, 0.0, 20.0, 0, SampleFlag.GOOD)


def damping(limit_nm: float = LIMIT_NM) -> Damping:
    return Damping(FILE, DesignedFor.of(RIG, limit_nm), LiveEstimate(tracking_chain(0.01)))


def estimated(frequency_hz: float) -> Any:
    mode = Mode(frequency_hz, 0.05)
    return SimpleNamespace(status=Status.ESTIMATED, resonance=mode, frequency_std_hz=0.03)


def driven(one: Damping, speeds: list[float], *, skipped: int = 0, flags: SampleFlag = SampleFlag.GOOD) -> list[float]:
    """Give it speeds, cycle by cycle; skip cycles before the last, or flag the last sample. Return its torques."""
    torques = []
    for k, speed in enumerate(speeds):
        last = k == len(speeds) - 1
        sample = replace(SAMPLE, cycle=k, time_s=0.01 * k, speed_rad_s=speed, flags=flags if last else SampleFlag.GOOD)
        one(sample, Phase.MEASURE)
        torques.append(one.torque_nm(k + 1 + (skipped if last else 0)))
    return torques


def speeds() -> list[float]:
    random = np.random.default_rng(4)
    speed = 20.0 + 3.0 * np.sin(0.5 * np.arange(400)) + 0.05 * random.standard_normal(400)
    speed[200:220] += 30.0  # at the limit
    speed[300:303] = math.nan
    return speed.tolist()


def test_a_constant_speed_is_left_alone_and_no_torque_is_beyond_the_limit() -> None:
    assert max(map(abs, driven(damping(), [57.0] * 50))) < 1e-6
    torque = driven(damping(), speeds())
    assert max(map(abs, torque)) == LIMIT_NM
    assert torque[300:304] == [0.0] * 4  # it starts anew at the speed it then finds


@pytest.mark.parametrize(
    ("speed", "wrong"),
    [
        (math.nan, {}),
        (math.inf, {}),
        (25.0, {"flags": SampleFlag.M1_STALE}),
        (25.0, {"flags": SampleFlag.M1_DOUBTFUL}),
        (25.0, {"flags": SampleFlag.LATE}),
        (25.0, {"skipped": 1}),
    ],
)
def test_without_a_good_speed_of_the_cycle_before_its_torque_is_zero(speed: float, wrong: dict[str, Any]) -> None:
    before, last = driven(damping(), [20.0, 21.0, speed], **wrong)[-2:]
    assert before != 0.0
    assert last == 0.0


@pytest.mark.parametrize(("frequency_hz", "acts"), [(7.3, True), (8.2, True), (9.2, True), (6.8, False), (10.0, False)])
def test_it_is_off_in_the_cycle_after_the_resonance_has_left_the_region(frequency_hz: float, acts: bool) -> None:
    one = damping()
    assert driven(one, [20.0, 21.0])[-1] != 0.0
    one.live.latest = estimated(frequency_hz)
    assert all((torque != 0.0) is acts for torque in driven(one, [22.0, 23.0]))
    assert acts or f"the resonance is at {frequency_hz:.2f} Hz, the damper was designed for 7.40 to 9.10 Hz" in one.off


def test_it_is_off_where_its_torque_has_stood_at_the_limit_for_a_period() -> None:
    one = damping(1.0)
    torque = driven(one, [20.0 + 10.0 * (-1.0) ** k for k in range(20)])
    assert one.off.startswith("at 0.15 s: its torque stood at the limit of 1 Nm")
    assert torque[14] != 0.0
    assert torque[15:] == [0.0] * 5


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"filter": {"b": [100.0 * each for each in B], "a": A}}, "stable with the file's"),
        ({"filter": {"b": [4.0 * each for each in B], "a": A}}, "a sensitivity of at most 2"),
        ({"filter": {"b": [18.0, -18.0, 0.5], "a": A}}, "numbers that sum to 0"),
        ({"filter": {"b": B, "a": [1.0, -2.1, 1.2]}}, "a filter that is stable by itself"),
        ({"filter": {"b": B, "a": [1.0, math.nan, 0.3]}}, "a finite number"),
        ({"region_hz": [3.0, 4.0]}, "a range around the line.s 8.22 Hz"),
        ({"line": {**CONTENT["line"], "c": 9000.0}}, "a line with a resonance"),
        ({"rig": None}, "expected the rig it was designed for"),
    ],
)
def test_a_file_that_is_not_sound_is_refused(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    path = tmp_path / "damper.toml"
    path.write_text(tomlkit.dumps({k: v for k, v in {**CONTENT, **change}.items() if v is not None}), encoding="utf-8")
    with pytest.raises(FileProblem, match=said) as caught:
        drivable(path)
    assert str(path) in str(caught.value)
    path.write_text(damper_toml(FILE), encoding="utf-8")
    assert drivable(path) == (FILE, FILE.rig)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"": {"period_s": 0.02}}, r"period_s of the rig is 0.02, expected 0.01, for which it was designed"),
        ({"": {"name": "another"}}, "name of the rig is 'another', expected 'series-parallel"),
        ({"guard": {"prbs_limit_nm": 300.0}}, "prbs_limit_nm of the rig is 300.0, expected 120.0"),
        ({"prbs": {"amplitude_nm": 160.0}}, "PRBS and damper may come to 260 Nm, expected at most 240 Nm"),
        (
            {"experiments.cruise": {"torque_nm": 490.0}},
            "may come to 490 Nm, expected at most 480 Nm, which guard.sum",
        ),
        ({"experiments.cruise": {"prbs": False}}, "expected an experiment with the host's PRBS"),
    ],
)
def test_a_rig_or_experiment_it_is_not_for_is_refused_before_anything_is_connected(
    change: dict[str, dict[str, object]], said: str
) -> None:
    rig = RIG.model_copy(update=change[""]) if "" in change else changed(RIG, change)
    with pytest.raises(UsageError, match=f"--damper: .*{said}"):
        plan_run(rig, "cruise", damping())


def run_damped(one: Damping, samples: Samples, progress: Callable[[StopRequest, float], None]) -> str:
    """Drive it on the simulated rig; return the bus, with the drives disarmed."""
    stop = StopRequest()
    with served(RIG) as (server, rig):
        try:
            with open_devices(rig) as devices:
                plan = plan_run(rig, "cruise", one)
                run_plan(
                    devices,
                    plan,
                    fast(rig),
                    samples,
                    stop,
                    lambda phase, time_s: progress(stop, time_s if phase is Phase.MEASURE else 0.0),
                    observers=(one,),
                )
        finally:
            assert_disarmed(server.bus_url, 1, 2)
        return server.bus_url


def test_a_run_drives_it_through_the_guard_and_the_recording_keeps_the_prbs_apart() -> None:
    samples, one = Samples(), damping()
    run_damped(one, samples, lambda stop, time_s: None)
    assert {abs(row.prbs_nm) for row in samples.rows} == {120.0}
    added = [row.torque_ref_nm - row.prbs_nm for row in samples.rows]
    assert np.ptp(added) > 5.0  # far more than the slew of a cruise at rest lets the base torque move
    assert one.document()["off"] is None


def test_a_stopped_run_ends_at_zero_torque_with_the_damper_on() -> None:
    samples = Samples()
    with pytest.raises(KeyboardInterrupt):
        run_damped(damping(), samples, lambda stop, time_s: stop.request() if time_s >= 0.5 else None)
    assert len(samples.rows) == 51


def test_more_than_the_guard_allows_ends_the_run_at_zero_torque(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Damping, "torque_nm", lambda self, cycle: 121.0)
    with pytest.raises(CommandRefused, match=r"torque guard: .*PRBS torque is .* Nm, expected at most 120 Nm"):
        run_damped(damping(), Samples(), lambda stop, time_s: None)


def test_structured_text_and_c_give_the_hosts_torque_to_the_bit(tmp_path: Path) -> None:
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not here: the exported text can't be executed")
    rig = DesignedFor.of(RIG, LIMIT_NM)
    expected = driven(damping(), speeds())
    plc = Machine(damper_text(FILE, rig, ".st"), "FB_HilDamper", tmp_path)
    (tmp_path / "damper.c").write_text(damper_text(FILE, rig, ".c"))
    command = ["gcc", *FLAGS, "-o", str(tmp_path / "damper.so"), str(tmp_path / "damper.c")]
    subprocess.run(command, check=True)
    torque = ctypes.CDLL(str(tmp_path / "damper.so")).hil_damper_torque
    torque.restype = ctypes.c_double
    torque.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_double]
    state = ctypes.create_string_buffer(64)
    assert [plc(enable=True, speed=speed, frequency=8.2).torque for speed in speeds()] == expected
    assert [torque(state, 1, speed, 8.2) for speed in speeds()] == expected
    for enable, hz, acts in ((True, 10.0, False), (True, 8.2, False), (False, 8.2, False), (True, 0.0, True)):
        for speed in (21.0, 22.0):  # the first after it was off makes no torque
            both = (plc(enable=enable, speed=speed, frequency=hz).torque, torque(state, int(enable), speed, hz))
        assert [abs(each) > 1.0 for each in both] == [acts, acts]


def test_a_suffix_of_no_language_is_refused() -> None:
    with pytest.raises(UsageError, match=r"a file that ends in .st or .c, got '.txt'"):
        damper_text(FILE, DesignedFor.of(RIG, LIMIT_NM), ".txt")
