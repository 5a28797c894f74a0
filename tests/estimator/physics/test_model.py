"""The model refuses what is missing, unknown or non-physical, every fault at once."""

import math

import pytest

from estimator.errors import BadModel
from estimator.physics.model import DrivelineModel, Motion, Parameter, Structure, parameter_unit
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, model


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
        "parameters.J_M.tolerance",
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
    ],
)
def test_a_wrong_effect_is_refused(effects: dict[str, dict[str, float]], message: str) -> None:
    with pytest.raises(BadModel, match=message):
        model(TWO_MASS, effects=effects)


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
