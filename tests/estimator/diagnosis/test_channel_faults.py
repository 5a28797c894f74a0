"""Channels that are dead for a while, or run by another clock: said by name, and the rest goes into the fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import NOTHING, all_good_samples
from estimator.diagnosis.inference.score_tests import Screen, promising
from estimator.diagnosis.preconditions.channels import with_usable_channels
from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.model import DrivelineModel, natural_frequencies_rad_s
from estimator.physics.simulate import simulate
from estimator.signals.record import Channel, FloatArray, Location, OutputKind, Record
from tests.estimator.diagnosis.plain import Bench
from tests.estimator.physics.bench import (
    ANGLE,
    LOAD_SPEED,
    SAMPLE_TIME_S,
    SPEED,
    TWO_MASS,
    exact_states,
    model,
    random_steps,
    record,
    scaled,
)

N, DT = 4000, 0.01
TIME_S = DT * np.arange(N)
NOISE = 0.02


def states(seed: int = 1) -> FloatArray:
    return exact_states(
        TWO_MASS, random_steps(N, seed, hold=40), InitialCondition(5.0, 0.0, 20.0, load_speed_rad_s=20.0)
    )


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


SIGMA = 0.02


def drifting(line: DrivelineModel, true: Mapping[str, float], rate: float, samples: int) -> list[Record]:
    records = []
    for seed in (1, 2):
        rec = record(random_steps(samples, seed, hold=30), name=f"run_{seed}")
        p = flat_values(true, {"clock_drift": {"rate": rate}})
        clean = simulate(grid_for(line, [rec]), rec, p, InitialCondition(0.0, 0.0, 2.0, 0.0, 2.0))
        noise = SIGMA * np.random.default_rng(seed).standard_normal(samples)
        records.append(replace(rec, output=clean + noise))
    return records


@pytest.mark.parametrize(("samples", "stiffer"), [(1500, 1.0), (6000, 1.0), (3000, 2.2), (3000, 8.0)])
@pytest.mark.parametrize("periods", [-0.65, 0.65])
def test_the_rate_is_found_on_slow_and_fast_lines(periods: float, samples: int, stiffer: float) -> None:
    given = scaled(TWO_MASS, k=stiffer)
    line, true = model(given), scaled(given, J_M=1.1, k=0.93, c=1.15)
    duration_s = samples * SAMPLE_TIME_S
    rate = periods * 2.0 * np.pi / natural_frequencies_rad_s(true)[-1] / duration_s
    records = drifting(line, true, rate, samples)
    bench = Bench(line, records, all_good_samples(records))
    nominal = bench.fit(NOTHING)
    looks = promising(Screen(nominal, line).starts("clock_drift"))
    found = bench.fit(frozenset({"clock_drift"}), nominal, [look.release for look in looks])
    assert found.value("clock_drift", "rate") == pytest.approx(rate, rel=0.01)
    assert found.rms == pytest.approx(SIGMA, rel=0.05)
