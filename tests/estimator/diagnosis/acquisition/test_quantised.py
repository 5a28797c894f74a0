"""A coarse speed lattice is recognised whatever its step, a fine one is left alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.acquisition.chain import recognise
from estimator.signals.record import FloatArray
from tests.estimator.diagnosis.acquisition.bench import KINDS, NOISE, PERIOD_S, drives, healthy

ENCODER_COUNT = 2.0 * np.pi / 2048 / PERIOD_S
"""Speed of one count per period of an encoder with 2048 counts a turn [rad/s]."""


def step_found(make, seed: int = 1) -> tuple[float, tuple[float, float]]:
    (finding,) = recognise([replace(record, output=make(record.output)) for record in healthy(seed)])
    assert finding.name == "speed_quantisation"
    return finding.parameters["step_rad_s"].value, finding.parameters["step_rad_s"].ci95


@pytest.mark.parametrize("step", [0.1, 0.2, ENCODER_COUNT, 1.0, 2.0])
@pytest.mark.parametrize("rounding", [np.round, np.floor, np.trunc])
def test_the_step_is_found(step: float, rounding) -> None:
    value, ci95 = step_found(lambda speed: rounding(speed / step) * step)
    assert value == pytest.approx(step, rel=1e-6)
    assert ci95[0] <= value <= ci95[1]


@pytest.mark.campaign
def test_the_interval_knows_that_a_level_is_rounded_alike_each_time() -> None:
    """Of 60 steps written with five decimals; 95 % intervals hold fewer than 51 of 60 once in a hundred."""
    steps = np.random.default_rng(5).uniform(0.3, 1.0, 60)
    held = 0
    for step in steps:
        _, (low, high) = step_found(lambda speed, step=step: np.round(np.round(speed / step) * step, 5))
        held += low <= step <= high
        assert high - low < 1e-5
    assert held >= 51


@pytest.mark.parametrize("step", [4.0 * NOISE, 10.0 * NOISE])
@pytest.mark.parametrize("seed", range(4))
def test_the_step_is_found_behind_noise(step: float, seed: int) -> None:
    """The lattice is that of the true speed; the noise comes on top."""
    records = [
        truth.record(kind, speed=np.round(truth.speed() / step) * step)
        for kind, truth in zip(KINDS, drives(seed), strict=True)
    ]
    (finding,) = recognise(records)
    assert finding.parameters["step_rad_s"].value == pytest.approx(step, rel=0.02)


def finely(speed: FloatArray) -> FloatArray:
    return np.round(speed / (0.4 * NOISE)) * 0.4 * NOISE


@pytest.mark.parametrize("seed", range(4))
def test_a_fine_lattice_is_no_finding(seed: int) -> None:
    assert recognise([replace(record, output=finely(record.output)) for record in healthy(seed)]) == ()
