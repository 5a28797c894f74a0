"""Recordings that no diagnosis can be built on are refused, with the reason and the cure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis import diagnose
from estimator.diagnosis.preconditions import FEWEST_SAMPLES, check
from estimator.errors import BadModel, BadShape, NotExciting
from estimator.physics.simulate import Start
from estimator.signals.record import Location, OutputKind, Record
from tests.estimator.physics.bench import ONE_MASS, linear_record, model, random_steps

LINE = model(ONE_MASS)


def drive(name: str = "run_1", samples: int = 400) -> Record:
    return linear_record(ONE_MASS, random_steps(samples, seed=1), Start(0.0, 0.0, 3.0), sigma=0.01, name=name)


def test_recordings_that_belong_together_pass() -> None:
    check([drive("a"), drive("b", 600)], LINE, [drive("c")])


def test_no_recording_at_all() -> None:
    with pytest.raises(BadShape, match="no recording was given, expected at least one"):
        check([], LINE, [drive()])


@pytest.mark.parametrize("holdout", [False, True])
def test_a_name_used_twice(holdout: bool) -> None:
    message = "recordings must have different names, came run_1, run_1. Rename the files."
    with pytest.raises(BadShape, match=message):
        check([drive()] if holdout else [drive(), drive()], LINE, [drive()] if holdout else [])


def test_different_sampling_periods() -> None:
    slow = replace(drive("slow"), sample_time_s=0.02)
    message = r"recording slow: sampling period 0.02 s, expected 0.01 s as in run_1. Diagnose recordings of one period"
    with pytest.raises(BadShape, match=message):
        check([drive(), slow], LINE, [])


def test_a_period_that_differs_by_rounding_passes() -> None:
    check([drive(), replace(drive("b"), sample_time_s=0.01 * (1.0 + 1e-4))], LINE, [])


def test_different_outputs() -> None:
    position = replace(drive("turned"), kind=OutputKind.POSITION)
    message = r"recording turned: output is position at the motor, expected speed at the motor as in run_1"
    with pytest.raises(BadShape, match=message):
        check([drive()], LINE, [position])


def test_an_output_that_the_structure_lacks() -> None:
    with pytest.raises(BadModel, match="recording run_1: speed at the load is no output of one_mass"):
        check([replace(drive(), location=Location.LOAD)], LINE, [])


@pytest.mark.parametrize("samples", [FEWEST_SAMPLES - 1, 20])
def test_too_short(samples: int) -> None:
    message = f"recording run_1: {samples} good samples, expected at least {FEWEST_SAMPLES}. Record longer."
    with pytest.raises(NotExciting, match=message):
        check([drive(samples=samples)], LINE, [])


def test_too_much_masked() -> None:
    rec = drive()
    with pytest.raises(NotExciting, match="run_1: 150 good samples, expected at least 200"):
        check([replace(rec, okay=np.arange(400) < 150)], LINE, [])


def test_a_torque_that_never_changes() -> None:
    rec = drive("dead")
    flat = replace(rec, torque_nm=np.full((400, 1), 12.5))
    message = r"recording dead: the torque is constant at 12.5, expected it to vary. Excite the driveline"
    with pytest.raises(NotExciting, match=message) as refusal:
        check([drive(), flat], LINE, [])
    assert refusal.value.names == ("dead",)


def test_an_output_that_never_changes_where_it_counts() -> None:
    rec = drive()
    okay = np.arange(400) >= 50
    frozen = replace(rec, output=np.where(okay, 3.25, np.nan), okay=okay)
    with pytest.raises(NotExciting, match=r"run_1: the output is constant at 3.25, expected it to vary"):
        check([frozen], LINE, [])


def test_the_diagnosis_refuses_before_it_fits() -> None:
    called = []
    with pytest.raises(NotExciting, match="Record longer"):
        diagnose([drive(samples=100)], LINE, progress=lambda message, share: called.append(message))
    assert called == []
