"""Clocks that part by more than half a period of the resonance before the recording ends are found from the start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import NOTHING, everything
from estimator.diagnosis.inference.score_tests import Screen, promising
from estimator.physics.driveline import Start
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.model import DrivelineModel, natural_frequencies_rad_s
from estimator.physics.simulate import simulate
from estimator.signals.record import Record
from tests.estimator.diagnosis.plain import Bench
from tests.estimator.physics.bench import SAMPLE_TIME_S, TWO_MASS, model, random_steps, record, scaled

SIGMA = 0.02


def drifting(line: DrivelineModel, true: Mapping[str, float], rate: float, samples: int) -> list[Record]:
    records = []
    for seed in (1, 2):
        rec = record(random_steps(samples, seed, hold=30), name=f"run_{seed}")
        p = flat_values(true, {"clock_drift": {"rate": rate}})
        clean = simulate(grid_for(line, [rec]), rec, p, Start(0.0, 0.0, 2.0, 0.0, 2.0))
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
    bench = Bench(line, records, everything(records))
    nominal = bench.fit(NOTHING)
    looks = promising(Screen(nominal, line).starts("clock_drift"))
    found = bench.fit(frozenset({"clock_drift"}), nominal, [each.release for each in looks])
    assert found.value("clock_drift", "rate") == pytest.approx(rate, rel=0.01)
    assert found.rms == pytest.approx(SIGMA, rel=0.05)
