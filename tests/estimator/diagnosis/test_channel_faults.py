"""Channels that are dead for a while, or run by another clock: said by name, and the rest goes into the fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.preconditions.channels import with_usable_channels
from estimator.physics.driveline import Start
from estimator.signals.record import Channel, FloatArray, Location, OutputKind, Record
from tests.estimator.physics.bench import ANGLE, LOAD_SPEED, SPEED, TWO_MASS, exact_states, random_steps, record

N, DT = 4000, 0.01
TIME_S = DT * np.arange(N)
NOISE = 0.02


def states(seed: int = 1) -> FloatArray:
    return exact_states(TWO_MASS, random_steps(N, seed, hold=40), Start(5.0, 0.0, 20.0, load_speed_rad_s=20.0))


def with_channel(
    values: FloatArray, kind: OutputKind = OutputKind.SPEED, location: Location = Location.LOAD, seed: int = 1
) -> Record:
    """Return a recording of the motor's speed with a further output, each with its noise."""
    random = np.random.default_rng(seed)
    speed = states(seed)[:, SPEED] + NOISE * random.standard_normal(N)
    read = values + NOISE * random.standard_normal(N)
    channel = Channel(kind, location, "w2", read, np.ones(N, dtype=np.bool_))
    return replace(record(random_steps(N, seed, hold=40), speed), channels=(channel,))


@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("state", [LOAD_SPEED, ANGLE])
def test_a_sensor_elsewhere_in_the_line_has_no_clock_of_its_own(state: int, seed: int) -> None:
    kind = OutputKind.POSITION if state == ANGLE else OutputKind.SPEED
    mended, warnings = with_usable_channels([with_channel(states(seed)[:, state], kind, seed=seed)])
    assert warnings == []
    assert len(mended[0].channels) == 1


@pytest.mark.parametrize("ppm", [-2000.0, 2000.0])
def test_a_channel_by_another_clock_is_left_out(ppm: float) -> None:
    drifting = np.interp(TIME_S * (1.0 + ppm * 1e-6), TIME_S, states()[:, LOAD_SPEED])
    mended, (warning,) = with_usable_channels([with_channel(drifting)])
    assert mended[0].channels == ()
    assert "the output w2 is not used: its clock" in warning
    apart = float(warning.split("differ by ")[1].split(" ppm")[0])
    assert apart == pytest.approx(abs(ppm), rel=0.2)


@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("kind", [OutputKind.SPEED, OutputKind.ACCELERATION])
def test_a_channel_that_shows_noise_alone_is_left_out(kind: OutputKind, seed: int) -> None:
    mended, (warning,) = with_usable_channels([with_channel(np.full(N, 3.0), kind, seed=seed)])
    assert mended[0].channels == ()
    assert "does not follow the motor at all" in warning


def test_where_a_channel_is_dead_it_is_not_used() -> None:
    speed = states()[:, LOAD_SPEED]
    whole = with_channel(speed)
    dead = whole.channels[0].output.copy()
    dead[1000:1400] = dead[999]
    mended, (warning,) = with_usable_channels([replace(whole, channels=(replace(whole.channels[0], output=dead),))])
    (channel,) = mended[0].channels
    assert np.flatnonzero(~channel.okay).tolist() == list(range(999, 1400))
    assert "from 9.99 to 13.99 s, while the motor moves" in warning
