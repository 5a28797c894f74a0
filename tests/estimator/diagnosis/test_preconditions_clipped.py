"""Readings that are cut off: reported with channel, value and share, and left out where they are the output's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.preconditions.channels import clipped, without_clipped
from estimator.physics.driveline import Start
from estimator.signals.record import FloatArray, Record
from tests.estimator.physics.bench import ONE_MASS, linear_record, random_steps

N = 2000
TIME_S = 0.01 * np.arange(N)
SWING = 10.0 * np.sin(TIME_S) + 0.5 * np.sin(9.0 * TIME_S)
SEEN = np.ones(N, dtype=bool)


def drive() -> Record:
    return linear_record(ONE_MASS, random_steps(N, seed=1), Start(0.0, 0.0, 3.0), sigma=0.02)


@pytest.mark.parametrize(("limit", "sign"), [(8.0, 1.0), (8.0, -1.0), (9.9, 1.0)])
def test_a_reading_cut_off_is_found(limit: float, sign: float) -> None:
    found = clipped("speed", sign * np.minimum(SWING, limit), SEEN)
    assert [each.value for each in found] == [sign * limit]
    assert np.array_equal(found[0].rows, SWING >= limit)


SOUND: dict[str, FloatArray] = {
    "a swing": SWING,
    "a swing read in coarse steps": np.round(SWING),
    "a swing read in fine steps": np.round(10.0 * np.sin(TIME_S), 2),
    "settled, read in steps": np.round(30.0 * (1.0 - np.exp(-2.0 * TIME_S)), 3),
    "settled to the last bit": 30.0 * (1.0 - np.exp(-10.0 * TIME_S)),
    "at rest": np.maximum(SWING, 0.0),
    "held at several values": np.repeat([10.0, 20.0, 15.0, 20.0], N // 4),
    "on and off": random_steps(N, seed=2),
    "forward, off, back": np.sign(SWING) * (np.abs(SWING) > 3.0),
    "a quantised cruise": np.round(50.0 + 0.3 * np.random.default_rng(2).standard_normal(N)),
}


@pytest.mark.parametrize("name", SOUND)
def test_what_is_not_cut_off_is_let_be(name: str) -> None:
    assert clipped("speed", SOUND[name], SEEN) == []


def test_rows_that_were_not_read_do_not_count() -> None:
    cut = np.minimum(SWING, 8.0)
    assert clipped("speed", cut, SWING < 8.0) == []
    assert clipped("speed", cut, np.zeros(N, dtype=bool)) == []


def test_the_output_is_masked_where_it_is_cut_off() -> None:
    whole = drive()
    limit = float(np.quantile(whole.output, 0.9))
    cut = replace(whole, output=np.minimum(whole.output, limit))
    (mended,), warnings = without_clipped([cut])
    assert np.array_equal(mended.okay, whole.output < limit)
    assert warnings == [
        f"recording run: the speed stands at its limit {limit:g} in 10.0% of the rows: its reading is cut off there; "
        "these rows are not used. Widen the range of the sensor or of its scale."
    ]


def test_a_torque_at_its_limit_is_reported_and_stays() -> None:
    whole = drive()
    cut = replace(whole, torque_nm=np.column_stack([SWING, np.minimum(SWING, 8.0)]))
    (mended,), warnings = without_clipped([cut])
    assert mended is cut
    assert len(warnings) == 1
    assert "recording run: torque input 2 stands at its limit 8 in " in warnings[0]
    assert "the verdict can't be trusted: mask these rows" in warnings[0]
