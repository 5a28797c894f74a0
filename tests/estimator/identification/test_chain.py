"""The on-line chain: sample by sample and in blocks the same bits, and nothing raises on a value."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.errors import BadSetting
from estimator.identification.chain import OnlineChain, OnlineTrajectory
from estimator.identification.identify import identify
from estimator.identification.online.adaptation import ConstantForgetting
from estimator.identification.settings import Settings
from estimator.identification.tracking.alarm import TrackingState
from estimator.identification.tracking.watch import WatchSettings
from estimator.signals.record import Record
from tests.estimator.identification.driveline import Cruise
from tests.estimator.identification.tracking.drives import Line, drives

TRACKING = Settings(adaptation=ConstantForgetting(0.995))
BEFORE_THE_CHANGE = 2400
COLUMNS = ("time_s", "frequency_hz", "damping", "height", "frequency_std_hz", "damping_std", "state")


@pytest.fixture(scope="module")
def drive() -> Record:
    """A drive with a change, missing samples, a bad number, and a PRBS that is off for a while."""
    lines = (Line(), Line(50.0, k=3400.0))
    record = drives(3, 1, 60.0, lines, prbs_nm=lambda time_s: 0.0 if 26.0 <= time_s < 34.0 else 120.0)[0]
    okay, output = record.okay.copy(), record.output.copy()
    okay[700:720] = False
    okay[2000] = False
    output[2000] = np.nan
    return replace(record, okay=okay, output=output)


def chain() -> OnlineChain:
    return OnlineChain(TRACKING, 0.01)


def same(one: OnlineTrajectory, other: OnlineTrajectory) -> None:
    for name in COLUMNS:
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name
    assert one.estimates.theta.tobytes() == other.estimates.theta.tobytes()
    assert one.alarms == other.alarms
    assert one.alarm_at == other.alarm_at


def test_one_by_one_is_the_block_to_the_bit(drive: Record) -> None:
    block, live = chain().run(drive), chain()
    rows = zip(drive.time_s, drive.total_torque_nm, drive.output, drive.okay, strict=True)
    pushed = [estimate for row in rows if (estimate := live.push(*row)) is not None]
    assert len(pushed) == len(block) == 3000
    assert block.alarms
    for one, other in zip(pushed, block, strict=True):
        assert one.time_s == other.time_s
        assert one.estimate.theta.tobytes() == other.estimate.theta.tobytes()
        assert one.resonance == other.resonance
        assert one.model == other.model
        assert (one.frequency_std_hz == other.frequency_std_hz) or np.isnan(one.frequency_std_hz)
        assert one.alarm == other.alarm
        assert one.state is other.state
    assert {TrackingState.NOT_EXCITED, TrackingState.WATCHING, TrackingState.SETTLING} <= {one.state for one in pushed}


@pytest.mark.parametrize("size", [7, 1000])
def test_any_blocks_are_the_whole_to_the_bit(drive: Record, size: int) -> None:
    whole, parts = chain().run(drive), chain()
    done: list[OnlineTrajectory] = []
    for first in range(0, drive.time_s.size, size):
        part = slice(first, first + size)
        done.append(
            parts.run_block(drive.time_s[part], drive.total_torque_nm[part], drive.output[part], drive.okay[part])
        )
    for name in COLUMNS:
        assert np.concatenate([getattr(part, name) for part in done]).tobytes() == getattr(whole, name).tobytes()
    assert tuple(alarm for part in done for alarm in part.alarms) == whole.alarms


@pytest.mark.parametrize("at", [333, 5300])
def test_continues_from_a_saved_state_to_the_bit(drive: Record, at: int, tmp_path: object) -> None:
    signals = (drive.time_s, drive.total_torque_nm, drive.output, drive.okay)
    first, second = chain(), chain()
    first.run_block(*(values[:at] for values in signals))
    path = f"{tmp_path}/state.npz"
    np.savez(path, **first.state())
    with np.load(path) as state:
        second.restore(dict(state))
    rest = [values[at:] for values in signals]
    same(second.run_block(*rest), first.run_block(*rest))


def test_a_state_of_other_settings_is_refused() -> None:
    state = chain().state()
    with pytest.raises(BadSetting, match="settings"):
        OnlineChain(Settings(), 0.01).restore(state)
    with pytest.raises(BadSetting, match="settings"):
        OnlineChain(TRACKING, 0.01, watch=WatchSettings(1.0)).restore(state)
    del state["watch.past"]
    with pytest.raises(BadSetting, match=r"watch\.past"):
        chain().restore(state)


@pytest.mark.parametrize("L", [None, "batch"])
def test_finds_the_resonance_with_and_without_a_batch_model(cruises: list[Cruise], L: str | None) -> None:
    first, *others = cruises[:4]
    own = None if L is None else identify(first.record).L
    for cruise in others:
        last = OnlineChain(Settings(), 0.01, own).run(cruise.record)[-1]
        assert last.resonance is not None
        assert last.resonance.frequency_hz == pytest.approx(cruise.resonance_hz, rel=0.02)
        assert last.resonance.damping == pytest.approx(cruise.damping, rel=0.15)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e308])
def test_no_value_raises_or_stays(drive: Record, bad: float) -> None:
    live, clean = chain(), drive.total_torque_nm
    torque, output = clean.copy(), drive.output.copy()
    torque[3000:3010], output[3300:3310] = bad, bad
    course = live.run_block(drive.time_s, torque, output, drive.okay)
    assert np.isfinite(course.estimates.theta).all()
    if not np.isfinite(bad):
        assert course.frequency_hz[BEFORE_THE_CHANGE] == pytest.approx(Line().resonance[0], rel=0.02)
