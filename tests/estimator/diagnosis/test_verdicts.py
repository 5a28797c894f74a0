"""Verdicts on drivelines whose missing physics was simulated by independent code (``hil.proof.truth``).

Each effect of the catalogue is planted in other formulations than those fitted here; so are buses with nothing missing
and buses with effects that the catalogue does not have. The seeds are the first ones, not chosen.
"""

from __future__ import annotations

import numpy as np
import pytest

from estimator.diagnosis import Diagnosis, Verdict, diagnose
from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.signals.record import Record
from hil.proof.truth.case import Case, TruthRecording, make_case

TOLERANCE = 0.2
SEED = 1


def record_of(recording: TruthRecording, name: str) -> Record:
    return Record(
        name=name,
        sample_time_s=0.01,
        time_s=recording.time_s,
        torque_nm=np.column_stack([recording.torque_m1_nm, recording.torque_m2_nm]),
        output=recording.speed_rad_s,
        okay=np.isfinite(recording.speed_rad_s),
    )


def nominal_of(case: Case) -> DrivelineModel:
    nominal = case.truth()["nominal"]
    assert isinstance(nominal, dict)
    names = Structure.TWO_MASS.parameter_names
    return DrivelineModel(Structure.TWO_MASS, {name: Parameter(nominal[name], TOLERANCE) for name in names})


def verdict_on(effect: str, seed: int = SEED) -> tuple[Diagnosis, Case]:
    case = make_case(effect, seed)
    records = [record_of(recording, f"run_{i + 1}") for i, recording in enumerate(case.recordings)]
    return diagnose(records, nominal_of(case)), case


@pytest.mark.parametrize(
    ("effect", "element"),
    [
        ("actuator_lag", Element.TORQUE_PATH),
        ("transport_delay", Element.TORQUE_PATH),
        ("coulomb_friction_motor", Element.MOTOR),
        ("stribeck_friction", Element.MOTOR),
        ("backlash", Element.SHAFT),
        ("stiffness_nonlinearity", Element.SHAFT),
        ("road_grade", Element.LOAD),
    ],
)
def test_names_what_was_concealed(effect: str, element: Element) -> None:
    diagnosis, _ = verdict_on(effect)
    assert diagnosis.verdict is Verdict.EXPLAINED
    assert [found.name for found in diagnosis.effects] == [effect]
    assert diagnosis.mismatch.element is element
    assert diagnosis.fit.holdout_augmented < diagnosis.fit.holdout_retuned
    assert diagnosis.mismatch.p_value < 0.01


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nothing_missing_is_said_where_parameters_are_merely_off(seed: int) -> None:
    diagnosis, case = verdict_on("none", seed)
    assert diagnosis.verdict is Verdict.NO_MISMATCH
    assert diagnosis.effects == ()
    assert not diagnosis.mismatch.detected
    true = case.truth()["true"]
    assert isinstance(true, dict)
    for name in ("J_M", "J_L", "k", "c"):
        assert diagnosis.parameters[name].value == pytest.approx(true[name], rel=0.02)


@pytest.mark.parametrize(
    ("effect", "element"),
    [
        ("quadratic_friction", Element.MOTOR),
        ("aerodynamic_drag", Element.LOAD),
        ("brake_drag", Element.LOAD),
        ("resolver_error", Element.SPEED_SENSOR),
        ("inverter_gain_mismatch", Element.TORQUE_PATH),
    ],
)
def test_abstains_and_locates_what_it_has_no_name_for(effect: str, element: Element) -> None:
    diagnosis, _ = verdict_on(effect)
    assert diagnosis.verdict is Verdict.UNEXPLAINED
    assert diagnosis.effects == ()
    assert diagnosis.mismatch.detected
    assert diagnosis.mismatch.element is element


def test_size_of_a_gap_is_found() -> None:
    diagnosis, case = verdict_on("backlash")
    hidden = case.truth()["hidden"]
    assert isinstance(hidden, dict)
    gap = diagnosis.effects[0].parameters["gap_rad"]
    assert gap.value == pytest.approx(hidden["backlash"]["gap_rad"], rel=0.05)


def test_augmented_model_explains_fresh_recordings() -> None:
    """The augmented model is judged on recordings made after the verdict, against the noise of the speed reading."""
    from estimator.physics.free_run import free_run

    diagnosis, case = verdict_on("coulomb_friction_motor")
    errors = [free_run(diagnosis.augmented, record_of(fresh, f"fresh_{i}")).rms for i, fresh in enumerate(case.fresh)]
    assert float(np.median(errors)) < 1.2 * diagnosis.fit.noise_floor


def test_constant_direction_leaves_dry_friction_untestable() -> None:
    """Cruise alone can't tell dry friction from the constant load; the tool says so and names the test."""
    case = make_case("coulomb_friction_motor", SEED)
    diagnosis = diagnose([record_of(case.recordings[0], "cruise")], nominal_of(case))
    assert "coulomb_friction_motor" in [entry.name for entry in diagnosis.untestable]
    assert {entry.suggested_test for entry in diagnosis.untestable} == {"reversal"}
    assert diagnosis.verdict is Verdict.NO_MISMATCH
