"""Recordings that no diagnosis can be built on are refused, with the reason and the cure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis import diagnose
from estimator.diagnosis.preconditions.prepare import FEWEST_SAMPLES, prepare
from estimator.diagnosis.result import Verdict
from estimator.errors import BadModel, BadShape, NotExciting
from estimator.physics.driveline import Start
from estimator.signals.record import Location, OutputKind, Record
from tests.estimator.physics.bench import ONE_MASS, linear_record, model, random_steps

LINE = model(ONE_MASS)


def drive(name: str = "run_1", samples: int = 400) -> Record:
    return linear_record(ONE_MASS, random_steps(samples, seed=1), Start(0.0, 0.0, 3.0), sigma=0.01, name=name)


def test_recordings_that_belong_together_pass() -> None:
    prepare([drive("a"), drive("b", 600)], LINE, [drive("c")])


def test_no_recording_at_all() -> None:
    with pytest.raises(BadShape, match="no recording was given, expected at least one"):
        prepare([], LINE, [drive()])


@pytest.mark.parametrize("holdout", [False, True])
def test_a_name_used_twice(holdout: bool) -> None:
    message = "recordings must have different names, got run_1, run_1. Rename the files."
    with pytest.raises(BadShape, match=message):
        prepare([drive()] if holdout else [drive(), drive()], LINE, [drive()] if holdout else [])


def test_different_sampling_periods() -> None:
    slow = replace(drive("slow"), sample_time_s=0.02)
    message = r"recording slow: sampling period 0.02 s, expected 0.01 s as in run_1. Diagnose recordings of one period"
    with pytest.raises(BadShape, match=message):
        prepare([drive(), slow], LINE, [])


def test_a_period_that_differs_by_rounding_passes() -> None:
    prepare([drive(), replace(drive("b"), sample_time_s=0.01 * (1.0 + 1e-4))], LINE, [])


def test_different_outputs() -> None:
    position = replace(drive("turned"), kind=OutputKind.POSITION)
    message = r"recording turned: output is position at the motor, expected speed at the motor as in run_1"
    with pytest.raises(BadShape, match=message):
        prepare([drive()], LINE, [position])


def test_an_output_that_the_structure_lacks() -> None:
    with pytest.raises(BadModel, match="recording run_1: speed at the load is no output of one_mass"):
        prepare([replace(drive(), location=Location.LOAD)], LINE, [])


@pytest.mark.parametrize("samples", [FEWEST_SAMPLES - 1, 20])
def test_too_short(samples: int) -> None:
    message = f"recording run_1: {samples} good samples, expected at least {FEWEST_SAMPLES}. Record longer."
    with pytest.raises(NotExciting, match=message):
        prepare([drive(samples=samples)], LINE, [])


def test_too_much_masked() -> None:
    rec = drive()
    with pytest.raises(NotExciting, match="run_1: 150 good samples, expected at least 200"):
        prepare([replace(rec, okay=np.arange(400) < 150)], LINE, [])


def test_good_samples_in_scraps_only() -> None:
    """300 good samples in stretches of 0.3 s, 2 s apart: none of them can tell its own start and load."""
    rec = drive(samples=2300)
    scraps = replace(rec, okay=np.arange(2300) % 230 < 30)
    message = "run_1: gaps of more than 1 s cut it into 10 segments, none of which holds 2 s of good samples; it is not"
    with pytest.raises(NotExciting, match=message) as refusal:
        prepare([scraps], LINE, [])
    assert refusal.value.names == ("run_1",)


def test_another_number_of_torques() -> None:
    rec = drive("two")
    both = replace(rec, torque_nm=np.column_stack([rec.torque_nm, rec.torque_nm]))
    with pytest.raises(BadShape, match="recording two: 2 torque inputs, expected 1 as in run_1"):
        prepare([drive(), both], LINE, [])


def test_what_there_is_to_say_goes_into_the_diagnosis() -> None:
    """Of 30 s, 3 s of it were lost."""
    rec = drive(samples=3000)
    lost = replace(rec, okay=~((np.arange(3000) >= 1000) & (np.arange(3000) < 1300)))
    found = diagnose([lost], LINE)
    assert found.warnings == (
        "recording run_1: gaps of more than 1 s cut it into 2 segments, each with its own initial state and constant "
        "load.",
    )
    assert found.verdict is Verdict.NO_MISMATCH


def test_a_torque_that_never_changes() -> None:
    rec = drive("dead")
    flat = replace(rec, torque_nm=np.full((400, 1), 12.5))
    message = r"recording dead: the torque is constant at 12.5, expected it to vary. Excite the driveline"
    with pytest.raises(NotExciting, match=message) as refusal:
        prepare([drive(), flat], LINE, [])
    assert refusal.value.names == ("dead",)


def test_an_output_that_never_changes_where_it_counts() -> None:
    rec = drive()
    okay = np.arange(400) >= 50
    frozen = replace(rec, output=np.where(okay, 3.25, np.nan), okay=okay)
    with pytest.raises(NotExciting, match=r"run_1: the output is constant at 3.25, expected it to vary"):
        prepare([frozen], LINE, [])


def test_the_diagnosis_refuses_before_it_fits() -> None:
    called = []
    with pytest.raises(NotExciting, match="Record longer"):
        diagnose([drive(samples=100)], LINE, progress=lambda message, share: called.append(message))
    assert called == ["checking the recordings"]
