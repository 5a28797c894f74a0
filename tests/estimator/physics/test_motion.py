"""What a recording says of the motion: speed from position, sizes, changes of sign."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimator.errors import BadModel
from estimator.physics.model import DrivelineModel, EffectValue, Motion, Parameter, Structure, parameter_unit
from estimator.physics.motion import (
    measured_speed,
    reverses,
    speed_by_place,
    torque_reverses,
)
from estimator.signals.record import OutputKind
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, model, record

TIME_S = np.arange(500) * 0.01


@pytest.mark.parametrize("sample_time_s", [0.01, 0.001, 0.05])
def test_the_speed_of_a_parabola_is_exact_inside(sample_time_s: float) -> None:
    """A central difference is exact for a parabola, whatever its width."""
    time_s = np.arange(500) * sample_time_s
    rec = record(np.ones(500), 3.0 * time_s**2, kind=OutputKind.POSITION, sample_time_s=sample_time_s)
    speed = measured_speed(rec)
    inside = np.isfinite(speed)
    half = max(1, round(0.01 / sample_time_s))
    assert inside.sum() == 500 - 2 * half
    np.testing.assert_allclose(speed[inside], 6.0 * time_s[inside], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [(-5.0, 5.0, True), (0.0, 5.0, False), (-5.0, -0.1, False), (-0.04, 5.0, False), (-1.0, 5.0, True)],
)
def test_a_reversal_must_be_clear(low: float, high: float, expected: bool) -> None:
    assert reverses(record(np.ones(500), np.linspace(low, high, 500))) is expected


@pytest.mark.parametrize(("creep", "expected"), [(-0.04, False), (-0.06, True)])
def test_a_backward_creep_below_a_hundredth_of_the_speed_is_no_reversal(creep: float, expected: bool) -> None:
    speed = np.full(500, 5.0)
    speed[:50] = creep
    assert reverses(record(np.ones(500), speed)) is expected


@pytest.mark.parametrize(("low", "expected"), [(-100.0, True), (-9.0, False), (0.0, False), (-20.0, True)])
def test_a_torque_reversal_must_be_a_tenth_of_the_torque(low: float, expected: bool) -> None:
    assert torque_reverses(record(np.linspace(low, 100.0, 500))) is expected


def test_a_swing_that_repeats_passes_each_place_at_one_speed() -> None:
    swing = np.cos(2.0 * np.pi * TIME_S)
    assert speed_by_place(record(np.ones(500), swing, kind=OutputKind.POSITION)) > 0.9


def test_swings_of_different_speed_and_a_motion_that_continues_do_not() -> None:
    time_s = np.arange(1000) * 0.01
    phase = np.where(time_s < 5.0, 0.5 * time_s, 2.5 + 2.0 * (time_s - 5.0))
    slow_then_fast = np.abs(np.mod(phase, 1.0) - 0.5)  # to and fro, each time at one speed
    assert speed_by_place(record(np.ones(1000), slow_then_fast, kind=OutputKind.POSITION)) < 0.5
    assert speed_by_place(record(np.ones(500), TIME_S + np.sin(TIME_S), kind=OutputKind.POSITION)) == 0.0


def one_mass(**parameters: Parameter) -> DrivelineModel:
    nominal = {"J_M": Parameter(2.0, 0.1), "b_M": Parameter(0.5, 0.1)}
    return DrivelineModel(Structure.ONE_MASS, nominal | parameters)


@pytest.mark.parametrize("name", ["c", "b_M", "b_L"])
def test_damping_may_be_zero_but_not_negative(name: str) -> None:
    assert model(TWO_MASS | {name: 0.0}).values()[name] == 0.0
    with pytest.raises(BadModel, match=rf"parameters.{name}.value: expected a finite number 0 or greater, got -0.1"):
        model(TWO_MASS | {name: -0.1})


@pytest.mark.parametrize("tolerance", [-0.1, 1.0, math.nan])
def test_a_tolerance_is_a_share_below_one(tolerance: float) -> None:
    with pytest.raises(BadModel, match=rf"parameters.J_M.tolerance: expected .* from 0 up to 1, got {tolerance}"):
        one_mass(J_M=Parameter(2.0, tolerance))


def test_every_fault_is_reported_at_once() -> None:
    with pytest.raises(BadModel) as refusal:
        DrivelineModel(
            Structure.ONE_MASS, {"J_M": Parameter(-2.0, 3.0), "c": Parameter(1.0, 0.1)}, effects={"slipping_clutch": {}}
        )
    assert [line.split(":")[0] for line in str(refusal.value).splitlines()] == [
        "parameters.b_M",
        "parameters.c",
        "parameters.J_M.value",
        "effects.slipping_clutch",
    ]


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"slipping_clutch": {}}, "effects.slipping_clutch: unknown effect, expected one of inverter_gain_mismatch, "),
        ({"transport_delay": {}}, "effects.transport_delay.delay_s: missing, expected delay_s, before_nm"),
        (
            {"transport_delay": {"delay_s": 0.01, "tau": 1.0}},
            "effects.transport_delay.tau: unknown parameter, expected delay_s, before_nm",
        ),
        (
            {"transport_delay": {"delay_s": math.nan}},
            "transport_delay.delay_s.value: expected a finite number, got nan",
        ),
        ({"transport_delay": {"delay_s": -0.01}}, "delay_s.value: expected a number 0 or greater, got -0.01"),
        ({"backlash": {"gap_rad": -0.02}}, "effects.backlash.gap_rad.value: expected a number 0 or greater, got -0.02"),
        (
            {"stiffness_nonlinearity": {"hardening_per_rad2": 80.0, "shape": 0.0}},
            "effects.stiffness_nonlinearity.shape.value: expected a number greater than 0, got 0.0",
        ),
        (
            {"backlash": {"gap_rad": 0.02, "pull": 1.5}},
            "effects.backlash.pull.value: expected a number 0 or greater, up to 1, got 1.5",
        ),
        (
            {"warming_friction": {"cold_nm_s": 1.0, "time_constant_s": 5.0, "warm": 2.0}},
            "effects.warming_friction.warm.value: expected a number 0 or greater, up to 1, got 2.0",
        ),
        (
            {"stiffness_nonlinearity": {"hardening_per_rad2": 0.0, "stage_share": -2.0, "stage_rad": 0.05}},
            "effects.stiffness_nonlinearity.stage_share.value: expected a number -1 or greater, got -2.0",
        ),
        (
            {"brake_drag": {"brake_nm": 5.0, "from_s": 4.0, "to_s": 3.0}},
            "effects.brake_drag.to_s.value: expected a moment that is not before from_s = 4.0, when it begins, got 3",
        ),
        (
            {"brake_drag": {"brake_nm": 5.0, "from_s": 4.0}},
            "brake_drag.to_s.value: expected a moment .* before from_s = 4.0, when it begins, which is missing",
        ),
        (
            {"inertia_change": {"change_kg_m2": -TWO_MASS["J_L"]}},
            "effects.inertia_change: expected values that leave J_L = .* than 0, got change_kg_m2 = .* leave 0",
        ),
        (
            {"stiffness_change": {"change": -2.0}},
            "effects.stiffness_change: expected values that leave k = .* than 0, got change = -2.0, which leave -",
        ),
        ({"clock_drift": {"rate": -1.0}}, "rate.value: expected a number -0.5 or greater, up to 0.5, got -1.0"),
    ],
)
def test_a_wrong_effect_is_refused(effects: dict[str, dict[str, float]], message: str) -> None:
    with pytest.raises(BadModel, match=message):
        model(TWO_MASS, effects=effects)


@pytest.mark.parametrize("known", [EffectValue(-0.9, ci95=(-1.1, -0.7)), EffectValue(-0.9, tolerance=0.3)])
def test_what_is_known_of_an_effect_may_reach_beyond_what_a_line_has(known: EffectValue) -> None:
    """It says how little is known; a diagnosis moves the value within it, and its file is read again."""
    effects = {"stiffness_change": {"change": known}}
    assert "stiffness_change" in replace(model(TWO_MASS), effects=effects).effects


def test_a_shaft_effect_makes_no_sense_without_a_shaft() -> None:
    message = "effects.backlash: makes no sense in one_mass, expected joint, three_mass, two_mass"
    with pytest.raises(BadModel, match=message):
        model(ONE_MASS, effects={"backlash": {"gap_rad": 0.02, "contact_rad": 0.001}})


@pytest.mark.parametrize(
    ("name", "rotation", "translation"),
    [
        ("J_M", "kg m^2", "kg"),
        ("J_L", "kg m^2", "kg"),
        ("k", "Nm/rad", "N/m"),
        ("c", "Nm s/rad", "N s/m"),
        ("b_M", "Nm s/rad", "N s/m"),
        ("b_L", "Nm s/rad", "N s/m"),
    ],
)
def test_units_of_the_contract(name: str, rotation: str, translation: str) -> None:
    assert parameter_unit(name, Motion.ROTATION) == rotation
    assert parameter_unit(name, Motion.TRANSLATION) == translation
