"""Joints on a bench with something planted by other formulations, behind a load cell whose zero may be off."""

from __future__ import annotations

import pytest

from estimator.diagnosis import diagnose
from estimator.diagnosis.result import Diagnosis, Verdict
from estimator.diagnosis.thresholds import Judging
from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel, Parameter, Structure
from tests.estimator.diagnosis.bench_joint import Joint


def diagnosed(joint: Joint) -> Diagnosis:
    return diagnose([joint.record(number) for number in range(3)], joint.nominal())


@pytest.mark.parametrize("zero_error", [0.0, 800.0])
def test_a_spring_and_a_damper_miss_nothing(zero_error: float) -> None:
    assert diagnosed(Joint(zero_error=zero_error)).verdict is Verdict.NO_MISMATCH


def test_a_damper_whose_sheet_has_a_stiffness_is_given_no_law_for_it() -> None:
    joint = Joint(k=1.0, c=1.75e5)
    nominal = DrivelineModel(Structure.JOINT, {"k": Parameter(3e5, 0.95), "c": Parameter(1e5, 0.95)})
    found = diagnose([joint.record(number) for number in range(3)], nominal)
    assert found.effects == ()
    assert found.mismatch.element is Element.SHAFT


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("joint", "named"),
    [
        pytest.param(Joint(gap=0.012), {"backlash"}, marks=pytest.mark.campaign),
        (Joint(gap=0.012, zero_error=500.0), {"backlash"}),
        (Joint(friction=4000.0), {"shaft_hysteresis"}),
        (Joint(hardening=400.0), {"stiffness_nonlinearity"}),
        (Joint(crack=-0.3), {"stiffness_change"}),
        pytest.param(
            Joint(gap=0.012, hardening=300.0), {"backlash", "stiffness_nonlinearity"}, marks=pytest.mark.campaign
        ),
    ],
)
def test_what_was_planted_is_named_and_nothing_else(joint: Joint, named: set[str]) -> None:
    found = diagnosed(joint)
    assert found.verdict in (Verdict.EXPLAINED, Verdict.PARTLY_EXPLAINED), found.statement
    assert found.remainder is None or found.remainder.share < Judging.ALIKE_SHARE  # by the form of the law
    assert {effect.name for effect in found.effects} == named
    if joint.gap:
        gap = next(effect for effect in found.effects if effect.name == "backlash").parameters["gap_rad"]
        assert gap.value == pytest.approx(joint.gap, rel=0.02)


@pytest.mark.parametrize(
    ("preload", "zero_error"),
    [
        pytest.param(900.0, 0.0, marks=pytest.mark.campaign),
        pytest.param(0.0, 0.0, marks=pytest.mark.campaign),
        pytest.param(0.0, 900.0, marks=pytest.mark.campaign),
    ],
)
def test_a_gap_behind_a_slider_is_found_and_sized_whatever_constant_there_is(preload: float, zero_error: float) -> None:
    """A preload moves the slider's two torques, the zero of the load cell what an open gap shows.

    Half this gap is a twentieth of what the slider explains, and isn't named in addition to it (docs/how-good.md).
    """
    joint = Joint(k=3e4, gap=0.02, friction=5000.0, preload=preload, zero_error=zero_error)
    effects = {effect.name: effect.parameters for effect in diagnosed(joint).effects}
    assert set(effects) == {"shaft_hysteresis", "backlash"}
    assert effects["backlash"]["gap_rad"].value == pytest.approx(joint.gap, rel=0.05)
    assert effects["shaft_hysteresis"]["friction_nm"].value == pytest.approx(joint.friction, rel=0.03)
