"""One contract for every entry of the catalogue: names, units, nulls, starts, words, and what it refuses to judge."""

from __future__ import annotations

import math
import re
from types import MappingProxyType

import numpy as np
import pytest

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Effect, Element
from estimator.physics.effects import road_grade
from estimator.physics.effects.stiffness_nonlinearity import factor
from estimator.physics.layout import NOMINAL, SIZE, flat, flat_values, slot
from estimator.physics.model import Motion, Structure
from estimator.physics.simulate import Start, grid_for, simulate
from estimator.signals.record import FloatArray, Record
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps

# The table of CONTRACT.md, "The catalogue: names".
CONTRACT = {
    Element.TORQUE_PATH: "inverter_gain_mismatch torque_derating torque_saturation actuator_lag transport_delay "
    "torque_ripple",
    Element.MOTOR: "coulomb_friction_motor stribeck_friction quadratic_friction generator_coupled",
    Element.SHAFT: "backlash stiffness_nonlinearity stiffness_change shaft_hysteresis cardan_second_order "
    "extra_torsional_mode",
    Element.LOAD: "coulomb_friction_load aerodynamic_drag road_grade brake_drag tyre_slip load_imbalance "
    "inertia_change warming_friction",
    Element.SPEED_SENSOR: "resolver_error speed_filter speed_sign_blind speed_quantisation",
    Element.ACQUISITION: "stale_samples lost_samples sample_jitter clock_drift",
}
ELEMENT_OF = {name: element for element, names in CONTRACT.items() for name in names.split()}

# The last part of a parameter's name, and the units it may stand for (rotation).
UNIT_OF_SUFFIX = MappingProxyType({"nm": "Nm", "rad": "rad", "s": "s", "rad2": "1/rad^2", "rad_s": "rad/s"})

# Values that must stand in the sentence; the others shape the law and are reported in the table alone.
TOLD = {
    "actuator_lag": {"time_constant_s": 0.0123},
    "transport_delay": {"delay_s": 0.0123},
    "coulomb_friction_motor": {"friction_nm": 12.3},
    "stribeck_friction": {"excess_nm": 4.56, "coulomb_nm": 12.3, "stribeck_rad_s": 0.789},
    "backlash": {"gap_rad": 0.0123},
    "stiffness_nonlinearity": {"hardening_per_rad2": 45.6, "shape": 1.0},
    "road_grade": {"grade_rms_nm": 12.3},
}
EXPECTED_NUMBERS = {
    "actuator_lag": ["12.3 ms"],
    "transport_delay": ["12.3 ms"],
    "coulomb_friction_motor": ["12.3 Nm"],
    "stribeck_friction": ["16.9 Nm", "12.3 Nm", "0.789 rad/s"],  # breakaway is 12.3 + 4.56
    "backlash": ["0.0123 rad"],
    "stiffness_nonlinearity": ["0.0468 rad"],  # 1 + 45.6 e^2 = 1.1
    "road_grade": ["12.3 Nm"],
}

entries = pytest.mark.parametrize("entry", EFFECTS.values(), ids=list(EFFECTS))
laws = pytest.mark.parametrize("entry", [e for e in EFFECTS.values() if not e.profile], ids=lambda e: e.name)


@pytest.fixture(scope="module")
def reversal() -> Record:
    """Both signs of torque and speed, long enough for a road."""
    torque = random_steps(1000, seed=1, hold=40)
    return linear_record(TWO_MASS, torque, Start(0.0, 0.0, 0.5, 0.0, 0.5), sigma=0.02)


@pytest.fixture(scope="module")
def forward() -> Record:
    """Torque and speed of one sign, too short for a road."""
    torque = random_steps(500, seed=2, size_nm=20.0, mean_nm=60.0)
    return linear_record(TWO_MASS, torque, Start(0.0, 0.0, 40.0, 0.0, 40.0))


def output_with(entry: Effect, values: tuple[float, ...], rec: Record) -> FloatArray:
    line = model(TWO_MASS)
    named = {parameter.name: value for parameter, value in zip(entry.parameters, values, strict=True)}
    p = flat_values(TWO_MASS, {entry.name: named})
    return simulate(grid_for(line, [rec]), rec, p, Start(5.0, 0.0, 0.5, 0.0, 0.5))


@entries
def test_name_and_element_are_those_of_the_contract(entry: Effect) -> None:
    assert ELEMENT_OF[entry.name] is entry.element


@entries
def test_it_names_only_effects_of_the_contract(entry: Effect) -> None:
    for group in (entry.resembles, entry.equivalent, entry.contains):
        assert set(group) <= ELEMENT_OF.keys()
        assert len(set(group)) == len(group)
        assert entry.name not in group
    assert set(entry.equivalent) <= set(entry.resembles)
    assert set(entry.contains) <= set(EFFECTS)


@entries
def test_parameters_are_named_with_their_unit(entry: Effect) -> None:
    for parameter in entry.parameters:
        if parameter.dimension == "1":
            continue
        suffix = re.search(r"(rad_s|[a-z0-9]+)$", parameter.name)
        assert suffix is not None
        assert UNIT_OF_SUFFIX[suffix[0]] == parameter.unit(Motion.ROTATION)


@entries
def test_no_unit_of_translation_speaks_of_radians(entry: Effect) -> None:
    for parameter in entry.parameters:
        assert "rad" not in parameter.unit(Motion.TRANSLATION)
        assert "Nm" not in parameter.unit(Motion.TRANSLATION)


@laws
def test_null_parameters_leave_the_simulation_bit_equal(entry: Effect, reversal: Record) -> None:
    nominal = simulate(
        grid_for(model(TWO_MASS), [reversal]), reversal, flat(model(TWO_MASS)), Start(5.0, 0.0, 0.5, 0.0, 0.5)
    )
    nulls = tuple(parameter.null for parameter in entry.parameters)
    np.testing.assert_array_equal(output_with(entry, nulls, reversal), nominal)


@laws
def test_releasing_the_first_parameter_changes_the_simulation(entry: Effect, reversal: Record) -> None:
    scales = entry.scales(model(TWO_MASS), [reversal])
    for start in entry.starts(model(TWO_MASS), [reversal]):
        released = tuple(scale * x for scale, x in zip(scales, start, strict=True))
        held = (entry.parameters[0].null, *released[1:])
        change = output_with(entry, released, reversal) - output_with(entry, held, reversal)
        assert np.sqrt(np.mean(change**2)) > 1e-4 * np.ptp(reversal.output)


@entries
def test_starts_lie_inside_the_bounds(entry: Effect, reversal: Record) -> None:
    starts = entry.starts(model(TWO_MASS), [reversal])
    assert starts
    for start in starts:
        for parameter, x in zip(entry.parameters, start, strict=True):
            assert parameter.low <= x <= parameter.high


@entries
def test_the_null_lies_inside_the_bounds_or_below_what_the_fit_may_reach(entry: Effect, reversal: Record) -> None:
    """The first parameter, which decides whether the effect is there, can reach its null; others may stop short."""
    first = entry.parameters[0]
    assert first.low <= first.null <= first.high
    for parameter in entry.parameters:
        assert parameter.low < parameter.high


@entries
def test_scales_are_positive_and_finite(entry: Effect, reversal: Record) -> None:
    scales = entry.scales(model(TWO_MASS), [reversal])
    assert len(scales) == len(entry.parameters)
    assert all(math.isfinite(scale) and scale > 0 for scale in scales)


@entries
def test_the_sentence_tells_its_numbers_with_their_units(entry: Effect) -> None:
    said = entry.sentence(TOLD[entry.name], Motion.ROTATION)
    for number in EXPECTED_NUMBERS[entry.name]:
        assert number in said


@entries
def test_the_sentence_of_a_translation_speaks_of_newtons_and_metres(entry: Effect) -> None:
    said = entry.sentence(TOLD[entry.name], Motion.TRANSLATION)
    assert not re.search(r"\b(rad|Nm|rad/s)\b", said)


@pytest.mark.parametrize(
    ("hardening", "shape", "word"), [(45.6, 1.0, "hardens"), (45.6, 2.5, "hardens"), (-45.6, 0.5, "softens")]
)
def test_the_stiffness_has_changed_by_a_tenth_at_the_twist_told(hardening: float, shape: float, word: str) -> None:
    values = {"hardening_per_rad2": hardening, "shape": shape}
    said = EFFECTS["stiffness_nonlinearity"].sentence(values, Motion.ROTATION)
    (number,) = re.findall(r"at ([0-9.]+) rad", said)
    assert word in said
    assert factor(float(number), hardening, shape) == pytest.approx(1.1 if hardening > 0 else 0.9, rel=1e-3)


@entries
def test_a_clear_reversal_can_tell_every_effect(entry: Effect, reversal: Record, forward: Record) -> None:
    assert entry.testable(model(TWO_MASS), [reversal]) is None
    assert entry.testable(model(TWO_MASS), [forward, reversal]) is None


@pytest.mark.parametrize(
    ("name", "reason", "test"),
    [
        ("coulomb_friction_motor", "the speed never changes sign", "reversal"),
        ("stribeck_friction", "the speed never changes sign", "reversal"),
        ("backlash", "the shaft torque never changes sign", "reversal"),
        ("road_grade", "every recording is shorter than 8 s", "cruise"),
    ],
)
def test_what_a_recording_can_not_tell_is_refused_with_the_test_that_would(
    name: str, reason: str, test: str, forward: Record
) -> None:
    obstacle = EFFECTS[name].testable(model(TWO_MASS), [forward])
    assert obstacle is not None
    assert obstacle.reason.startswith(reason)
    assert obstacle.suggested_test == test


@pytest.mark.parametrize("name", ["actuator_lag", "transport_delay", "stiffness_nonlinearity"])
def test_what_any_recording_can_tell_is_not_refused(name: str, forward: Record) -> None:
    assert EFFECTS[name].testable(model(TWO_MASS), [forward]) is None


@entries
def test_every_field_for_people_is_filled(entry: Effect) -> None:
    for text in (entry.title, entry.law, entry.source, entry.excited_by, *(p.meaning for p in entry.parameters)):
        assert len(text) > 3
    assert re.search(r"\d", entry.source)


def test_shaft_effects_need_a_shaft() -> None:
    for entry in EFFECTS.values():
        assert (Structure.ONE_MASS in entry.structures) is (entry.element is not Element.SHAFT)


def test_the_catalogue_can_not_be_changed() -> None:
    with pytest.raises(TypeError):
        EFFECTS["mine"] = EFFECTS["backlash"]  # type: ignore[index]


class TestLayout:
    def test_every_parameter_has_a_slot_of_its_own(self) -> None:
        slots = [slot("", name) for name in NOMINAL]
        slots += [slot(entry.name, p.name) for entry in EFFECTS.values() for p in entry.parameters]
        assert sorted(slots) == list(range(SIZE))

    def test_a_smaller_structure_leaves_the_rest_at_zero(self) -> None:
        vector = flat(model(ONE_MASS))
        assert vector[slot("", "J_M")] == ONE_MASS["J_M"]
        assert [vector[slot("", name)] for name in ("J_L", "k", "c", "b_L")] == [0.0] * 4

    def test_effects_are_at_their_null_unless_the_model_has_them(self) -> None:
        vector = flat(model(TWO_MASS, effects={"backlash": {"gap_rad": 0.03}}))
        assert vector[slot("backlash", "gap_rad")] == 0.03
        assert vector[slot("backlash", "contact_rad")] == 0.0
        assert vector[slot("stiffness_nonlinearity", "shape")] == 1.0


class TestRoadGradeBasis:
    TIME_S = np.arange(2001) * 0.01

    def test_with_the_first_spline_they_would_sum_to_one(self) -> None:
        """A cubic B-spline over [0, d] that starts the partition of unity is (1 - t/d)^3."""
        first = np.maximum(1.0 - self.TIME_S / road_grade.KNOT_SPACING_S, 0.0) ** 3
        np.testing.assert_allclose(road_grade.basis(self.TIME_S).sum(axis=0) + first, 1.0, atol=1e-12)

    def test_with_a_constant_it_reproduces_every_cubic(self) -> None:
        t = self.TIME_S / 20.0
        design = np.vstack([np.ones_like(t), road_grade.basis(self.TIME_S)]).T
        cubic = 3.0 - 2.0 * t + 5.0 * t**2 - 4.0 * t**3
        left = cubic - design @ np.linalg.lstsq(design, cubic, rcond=None)[0]
        np.testing.assert_allclose(left, 0.0, atol=1e-10)

    def test_a_smooth_road_is_followed_and_a_step_is_not(self) -> None:
        design = np.vstack([np.ones_like(self.TIME_S), road_grade.basis(self.TIME_S)]).T
        hill = np.sin(2 * np.pi * self.TIME_S / 15.0)
        step = np.where(self.TIME_S > 9.0, 1.0, -1.0)
        left = [profile - design @ np.linalg.lstsq(design, profile, rcond=None)[0] for profile in (hill, step)]
        assert np.sqrt(np.mean(left[0] ** 2)) < 5e-3
        assert np.sqrt(np.mean(left[1] ** 2)) > 0.1

    def test_it_has_a_spline_per_knot_spacing_and_is_local(self) -> None:
        splines = road_grade.basis(self.TIME_S)
        assert splines.shape == (10 + road_grade.DEGREE - 1, self.TIME_S.size)
        assert np.all((splines > 0).sum(axis=1) <= 4 * road_grade.KNOT_SPACING_S / 0.01 + 1)

    def test_it_can_be_evaluated_elsewhere_and_is_held_outside(self) -> None:
        splines = road_grade.basis(self.TIME_S + 100.0, np.array([99.0, 100.0, 107.5, 120.0, 130.0]))
        whole = road_grade.basis(self.TIME_S)
        np.testing.assert_allclose(splines, whole[:, [0, 0, 750, 2000, 2000]], atol=1e-12)
