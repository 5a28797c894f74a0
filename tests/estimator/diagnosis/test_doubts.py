"""What the input makes doubtful is named before anything is fitted: shifts, columns, recordings that do not belong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.preconditions.plausible import doubts_about
from estimator.errors import Implausible
from estimator.physics.driveline import InitialCondition
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.signals.record import Channel, FloatArray, Location, OutputKind, Record
from tests.estimator.physics.bench import TWO_MASS, linear_record, model, random_steps, record, scaled

SAMPLES = 2000
LINE = model(TWO_MASS)


def drive(values: dict[str, float] = TWO_MASS, seed: int = 3, name: str = "run", hold: int = 10) -> Record:
    torque = random_steps(SAMPLES, seed=seed, hold=hold)
    found = linear_record(values, torque, InitialCondition(10.0, 0.0, 20.0, 0.0, 20.0), sigma=0.02, name=name)
    own = 10.0 * np.sin(np.arange(SAMPLES) / 7.0)
    return replace(found, torque_nm=np.column_stack([0.6 * torque + own, 0.4 * torque - own]), inputs=("T1", "T2"))


@pytest.mark.parametrize("lag", [20, -20])
def test_a_shift_between_columns_is_doubted_and_no_line_cures_it(lag: int) -> None:
    shifted = replace(drive(), output=np.roll(drive().output, lag))
    (doubt,) = doubts_about([shifted], LINE)
    assert f"0.2 s {'late' if lag > 0 else 'early'} against the torque" in doubt.statement
    assert doubt.cure is None


def test_something_else_is_always_among_the_odds() -> None:
    shifted = replace(drive(), output=np.roll(drive().output, 20))
    assert "something else?" in doubts_about([shifted], LINE)[0].statement


def test_a_recording_of_another_vehicle_is_named_by_how_much() -> None:
    others = [drive(seed=seed, name=name, hold=100) for seed, name in ((3, "a"), (4, "b"))]
    (doubt,) = doubts_about([*others, drive(scaled(TWO_MASS, J_L=2.3), seed=5, name="c", hold=100)], LINE)
    assert doubt.about == "c"
    assert "another vehicle" in doubt.statement
    assert "in c alone?" in doubt.statement
    assert doubts_about([*others, drive(seed=5, name="c", hold=100)], LINE) == []


def test_a_torque_that_no_signal_names_is_named() -> None:
    whole = drive()
    second = Channel(OutputKind.TORQUE, Location.MOTOR, "T2", whole.torque_nm[:, 1], whole.okay)
    half = replace(whole, torque_nm=whole.torque_nm[:, :1] / 1.5, inputs=("T1",), unused=(second,))
    with pytest.raises(Implausible, match="T2 looks like a torque and is not used"):
        doubts_about([half], LINE)


def joint(sign: float) -> Record:
    twist: FloatArray = np.convolve(random_steps(SAMPLES, seed=8, size_nm=0.02), np.full(25, 0.04), mode="same")
    force = sign * (500.0 * twist + 20.0 * np.gradient(twist, 0.01))
    found = record(force, force, kind=OutputKind.FORCE)
    return replace(found, imposed=twist)


def test_a_force_turned_against_the_motion_is_refused_with_its_sign() -> None:
    line = DrivelineModel(Structure.JOINT, {"k": Parameter(450.0, 0.3), "c": Parameter(22.0, 0.3)})
    assert doubts_about([joint(1.0)], line) == []
    with pytest.raises(Implausible, match="sign of torque or motion turned round") as refusal:
        doubts_about([joint(-1.0)], line)
    assert refusal.value.cure is not None
    assert refusal.value.cure.torque == -1.0


def test_inertias_that_are_exchanged_are_named() -> None:
    exchanged = model(TWO_MASS | {"J_M": TWO_MASS["J_L"], "J_L": TWO_MASS["J_M"]})
    with pytest.raises(Implausible, match="are J_M and J_L exchanged in the model file"):
        doubts_about([drive()], exchanged)
