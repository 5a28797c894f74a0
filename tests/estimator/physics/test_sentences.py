"""What the catalogue says of a finding: every number that matters, in the units of the motion."""

import math
import re

import pytest

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Effect
from estimator.physics.effects.shaft import stiffness_factor
from estimator.physics.model import Motion

# What each sentence is given, and the numbers that must stand in it; the rest is reported in the table alone.
SENTENCES: dict[str, tuple[dict[str, float], list[str]]] = {
    "inverter_gain_mismatch": ({"gain_m1": 1.0, "gain_m2": 0.876}, ["m2", "0.876"]),
    "torque_derating": ({"depth": 0.123, "time_constant_s": 4.56, "heating_nm": 789.0}, ["12.3%", "4.56 s", "789 Nm"]),
    "torque_saturation": ({"limit_m1_nm": 45.6, "limit_m2_nm": 45.6, "limit_sum_nm": math.inf}, ["45.6 Nm"]),
    "actuator_lag": ({"time_constant_s": 0.0123}, ["12.3 ms"]),
    "transport_delay": ({"delay_s": 0.0123}, ["12.3 ms"]),
    "torque_ripple": ({"amplitude_nm": 4.56, "share": 0.0, "order": 6.0}, ["4.56 Nm", "6 times"]),
    "coulomb_friction_motor": ({"friction_nm": 12.3}, ["12.3 Nm"]),
    "stribeck_friction": (
        {"excess_nm": 4.56, "coulomb_nm": 12.3, "stribeck_rad_s": 0.789},
        ["16.9 Nm", "12.3 Nm", "0.789 rad/s"],  # breakaway is 12.3 + 4.56
    ),
    "quadratic_friction": ({"quadratic_nm_s2": 0.123}, ["0.123 Nm s^2/rad^2"]),
    "generator_coupled": ({"inertia_kg_m2": 1.23}, ["1.23 kg m^2"]),
    "backlash": ({"gap_rad": 0.0123}, ["0.0123 rad"]),
    "stiffness_nonlinearity": ({"hardening_per_rad2": 45.6, "shape": 1.0}, ["0.0468 rad"]),  # 1 + 45.6 e^2 = 1.1
    "stiffness_change": ({"change": -0.123}, ["-12.3%"]),
    "shaft_hysteresis": ({"friction_nm": 4.56, "yield_rad": 0.00123}, ["4.56 Nm", "0.00123 rad"]),
    "cardan_second_order": ({"amplitude_nm": 4.56, "angle_rad": 0.0, "share": 0.0}, ["4.56 Nm"]),
    "extra_torsional_mode": (
        {"inertia_kg_m2": 1.23, "frequency_hz": 45.6, "damping_ratio": 0.078},
        ["1.23 kg m^2", "45.6 Hz", "0.078"],
    ),
    "coulomb_friction_load": ({"friction_nm": 12.3}, ["12.3 Nm"]),
    "aerodynamic_drag": ({"drag_nm_s2": 0.123}, ["0.123 Nm s^2/rad^2"]),
    "road_grade": ({"grade_rms_nm": 12.3}, ["12.3 Nm"]),
    "brake_drag": ({"brake_nm": 12.3}, ["12.3 Nm"]),
    "tyre_slip": ({"slip_per_nm": 0.000123, "wheel_share": 0.0456, "creep_rad_s": 1.0}, ["0.000123 per Nm", "4.6%"]),
    "load_imbalance": ({"amplitude_nm": 4.56, "motor_turns_per_turn": 5.6}, ["4.56 Nm"]),
    "inertia_change": ({"change_kg_m2": -12.3}, ["-12.3 kg m^2"]),
    "warming_friction": ({"cold_nm_s": 1.23, "time_constant_s": 45.6}, ["1.23 Nm s/rad", "45.6 s"]),
    "resolver_error": ({"once_rad": 0.0123, "twice_rad": 0.00456}, ["12.3 mrad", "4.56 mrad"]),
    "speed_filter": ({"time_constant_s": 0.0123}, ["12.3 ms"]),
    "speed_sign_blind": ({"share": 0.98}, ["0.98"]),
    "clock_drift": ({"rate": -0.000123}, ["-123 ppm"]),
    "eddy_drag": ({"peak_nm": 12.3, "peak_rad_s": 4.56}, ["12.3 Nm", "4.56 rad/s"]),
    "asymmetric_friction": ({"difference_nm_s": -1.23}, ["1.23 Nm s/rad more backward"]),
    "gear_losses": ({"driving_share": 0.0456, "back_share": 0.0789}, ["4.56% driving", "7.89%"]),
    "torque_nonlinearity": (
        {"curvature_per_nm": 4e-4, "asymmetry_per_nm": 1e-4},
        ["1 % for each 20 Nm where it is positive", "33.3 Nm where it is negative"],
    ),
    "torque_bias": ({"offset_nm": -4.56, "time_constant_s": 7.89}, ["4.56 Nm below its reading", "7.89 s"]),
    "grounded_spring": ({"stiffness_nm_per_rad": 45.6}, ["45.6 Nm/rad"]),
    "gravity": ({"moment_nm": 4.56, "motor_turns_per_turn": 7.89}, ["4.56 Nm", "7.89 motor turns"]),
    "viscoelastic_shaft": ({"branch_share": 0.456, "relaxation_s": 0.0123}, ["45.6%", "12.3 ms"]),
}
SENTENCES |= {
    name: (dict(entry.example), []) for name, entry in EFFECTS.items() if entry.example and name not in SENTENCES
}

fitted = pytest.mark.parametrize("entry", [e for e in EFFECTS.values() if not e.recognised], ids=lambda e: e.name)


@fitted
def test_the_sentence_tells_its_numbers_with_their_units(entry: Effect) -> None:
    values, numbers = SENTENCES[entry.name]
    said = entry.sentence(values, Motion.ROTATION)
    for number in numbers:
        assert number in said


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        (
            "torque_saturation",
            {"limit_m1_nm": math.inf, "limit_m2_nm": math.inf, "limit_sum_nm": 78.9},
            "78.9 Nm in sum",
        ),
        ("inverter_gain_mismatch", {"gain_m1": 0.876, "gain_m2": 1.0}, "inverter m1 is 0.876 times"),
        ("torque_ripple", {"amplitude_nm": 0.0, "share": 0.0456, "order": 6.0}, "4.56% of itself at 6 times"),
        ("cardan_second_order", {"amplitude_nm": 0.0, "angle_rad": 0.0123, "share": 0.0}, "an angle of 0.0123 rad"),
        ("cardan_second_order", {"amplitude_nm": 0.0, "angle_rad": 0.0, "share": 0.0456}, "4.56% of its torque"),
    ],
)
def test_of_several_causes_the_one_found_is_reported(name: str, values: dict[str, float], said: str) -> None:
    assert said in EFFECTS[name].sentence(values, Motion.ROTATION)


@fitted
def test_the_sentence_of_a_translation_speaks_of_newtons_and_metres(entry: Effect) -> None:
    said = entry.sentence(SENTENCES[entry.name][0], Motion.TRANSLATION)
    assert not re.search(r"\b(rad|Nm|rad/s)\b", said)


@pytest.mark.parametrize(
    ("hardening", "shape", "word"), [(45.6, 1.0, "hardens"), (45.6, 2.5, "hardens"), (-45.6, 0.5, "softens")]
)
def test_the_stiffness_has_changed_by_a_tenth_at_the_twist_reported(hardening: float, shape: float, word: str) -> None:
    values = {"hardening_per_rad2": hardening, "shape": shape}
    said = EFFECTS["stiffness_nonlinearity"].sentence(values, Motion.ROTATION)
    (number,) = re.findall(r"at ([0-9.]+) rad", said)
    assert word in said
    assert stiffness_factor(float(number), hardening, shape) == pytest.approx(1.1 if hardening > 0 else 0.9, rel=1e-3)
