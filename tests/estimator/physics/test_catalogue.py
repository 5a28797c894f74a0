"""One contract for every entry of the catalogue: names, units, nulls, starts, words, and what it refuses to judge."""

import inspect
import math
import re
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import open_hypotheses
from estimator.physics import inputs as torque_path
from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import Start
from estimator.physics.effect import Effect, Element, Held, Place
from estimator.physics.kernel import slots
from estimator.physics.layout import flat, flat_values, grid_for, slot
from estimator.physics.model import Motion, Structure
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, OutputKind, Record
from tests.estimator.physics.bench import TWO_MASS, assert_same_to_rounding, linear_record, model, random_steps, record

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
UNIT_OF_SUFFIX = MappingProxyType(
    {
        "nm": "Nm",
        "rad": "rad",
        "s": "s",
        "hz": "Hz",
        "rad_s": "rad/s",
        "nm_s": "Nm s/rad",
        "nm_s2": "Nm s^2/rad^2",
        "kg_m2": "kg m^2",
        "per_nm": "1/Nm",
        "per_rad2": "1/rad^2",
        "nm_per_rad": "Nm/rad",
    }
)

# Parameters of a turning machine alone: their unit is an angle whatever the motion is called.
OF_A_TURN = frozenset({"once_rad", "twice_rad"})

entries = pytest.mark.parametrize("entry", EFFECTS.values(), ids=list(EFFECTS))
laws = pytest.mark.parametrize("entry", [e for e in EFFECTS.values() if not e.profile], ids=lambda e: e.name)
fitted = pytest.mark.parametrize("entry", [e for e in EFFECTS.values() if not e.recognised], ids=lambda e: e.name)
released = pytest.mark.parametrize(
    "entry", [e for e in EFFECTS.values() if not (e.profile or e.recognised)], ids=lambda e: e.name
)


GEARED = replace(model(TWO_MASS), gear_ratio=3.0)


@pytest.fixture(scope="module")
def reversal() -> Record:
    """Both signs of torque and speed from two inverters that share it in turns, long enough for a road."""
    torque = random_steps(1000, seed=1, hold=40)
    rec = linear_record(TWO_MASS, torque, Start(0.0, 0.0, 0.5, 0.0, 0.5), sigma=0.02)
    share = np.where(np.arange(1000) < 500, 0.5, 0.7)
    return replace(rec, torque_nm=np.column_stack([share * torque, (1.0 - share) * torque]))


@pytest.fixture(scope="module")
def forward() -> Record:
    """Torque of one sign and a speed that hardly changes, too short for a road."""
    torque = random_steps(500, seed=2, size_nm=20.0, mean_nm=60.0)
    return linear_record(TWO_MASS, torque, Start(10.0, 0.0, 40.0, 0.0, 40.0))


EXPERIMENTS = frozenset({"cruise", "reversal", "tip"})
"""Kinds of experiment that ``hil run`` knows; a suggested test must be one (tests/docs compare the two)."""


def output_with(entry: Effect, values: Mapping[str, float], rec: Record) -> FloatArray:
    p = flat_values(TWO_MASS, {entry.name: values})
    return simulate(grid_for(model(TWO_MASS), [rec]), rec, p, Start(5.0, 0.0, 0.5, 0.0, 0.5))


def start_values(entry: Effect, records: list[Record]) -> list[dict[str, float]]:
    """Return the start points of a fit in their units, an event lasting from 2 s to 6 s."""
    scales = entry.scales(GEARED, records)
    lasting = {"from_s": 2.0, "to_s": 6.0} if entry.event else {}
    return [
        lasting
        | {
            parameter.name: scale * (x.value if isinstance(x, Held) else x)
            for parameter, scale, x in zip(entry.shared_parameters, scales, start, strict=True)
        }
        for start in entry.starts(GEARED, records)
    ]


@pytest.mark.parametrize("name", ELEMENT_OF)
def test_every_name_of_the_contract_has_an_entry_at_its_element(name: str) -> None:
    """Further entries are extensions."""
    assert EFFECTS[name].element is ELEMENT_OF[name]


@entries
def test_it_names_only_effects_of_the_catalogue(entry: Effect) -> None:
    for group in (entry.resembles, entry.equivalent, entry.contains):
        assert set(group) <= EFFECTS.keys(), f"{entry.name} names effects that have no entry"
        assert len(set(group)) == len(group)
        assert entry.name not in group
    assert set(entry.equivalent) <= set(entry.resembles)
    assert set(entry.contains) <= set(EFFECTS)


@entries
def test_parameters_are_named_with_their_unit(entry: Effect) -> None:
    for parameter in entry.parameters:
        suffixes = [suffix for suffix in UNIT_OF_SUFFIX if parameter.name.endswith(f"_{suffix}")]
        named = UNIT_OF_SUFFIX[max(suffixes, key=len)] if suffixes else ""
        assert named == parameter.unit(Motion.ROTATION)


@entries
def test_no_unit_of_translation_speaks_of_radians(entry: Effect) -> None:
    for parameter in entry.parameters:
        if parameter.name in OF_A_TURN or parameter.name in entry.phases:
            continue
        assert "rad" not in parameter.unit(Motion.TRANSLATION)
        assert "Nm" not in parameter.unit(Motion.TRANSLATION)


@laws
def test_null_parameters_leave_the_simulation_bit_equal(entry: Effect, reversal: Record) -> None:
    nominal = simulate(
        grid_for(model(TWO_MASS), [reversal]), reversal, flat(model(TWO_MASS)), Start(5.0, 0.0, 0.5, 0.0, 0.5)
    )
    nulls = {parameter.name: parameter.null for parameter in entry.parameters}
    np.testing.assert_array_equal(output_with(entry, nulls, reversal), nominal)


@released
def test_the_decisive_parameter_at_its_null_is_no_effect_whatever_the_others_are(
    entry: Effect, reversal: Record
) -> None:
    """Inverters have a gain or a limit each, a resolver and joints several errors: there each decides for itself.

    So do the inertia and the softness of a mode in the line, and the losses of gears either way.
    """
    nominal = output_with(entry, {}, reversal)
    each = {
        "inverter_gain_mismatch",
        "torque_saturation",
        "resolver_error",
        "stribeck_friction",
        "extra_torsional_mode",
        "gear_losses",
    }
    for values in start_values(entry, [reversal]):
        several = entry.name in each or len(entry.phases) > 1
        decisive = entry.shared_parameters if several else entry.shared_parameters[:1]
        silent = values | {parameter.name: parameter.null for parameter in decisive}
        assert_same_to_rounding(output_with(entry, silent, reversal), nominal)


@released
def test_every_start_changes_the_simulation(entry: Effect, reversal: Record) -> None:
    nominal = output_with(entry, {}, reversal)
    for values in start_values(entry, [reversal]):
        change = output_with(entry, values, reversal) - nominal
        assert np.sqrt(np.mean(change**2)) > 1e-4 * np.ptp(reversal.output)


@fitted
def test_starts_lie_inside_the_bounds(entry: Effect, reversal: Record) -> None:
    starts = entry.starts(GEARED, [reversal])
    assert starts
    for start in starts:
        for parameter, x in zip(entry.shared_parameters, start, strict=True):
            if not isinstance(x, Held):
                assert parameter.low <= x <= parameter.high


@fitted
def test_one_start_at_least_is_fitted_at_all(entry: Effect, reversal: Record) -> None:
    for start in entry.starts(GEARED, [reversal]):
        assert any(not isinstance(x, Held) for x in start)


@fitted
def test_the_null_of_the_decisive_parameter_can_be_reached(entry: Effect) -> None:
    """Others may stop short of theirs; a limit that nothing reaches is as good as none."""
    first = entry.parameters[0]
    assert first.low <= first.null <= first.high or first.null == math.inf
    for parameter in entry.parameters:
        assert parameter.low < parameter.high


@entries
def test_events_have_their_moments_and_periodic_laws_their_phases(entry: Effect) -> None:
    own = [parameter.name for parameter in entry.own_parameters]
    assert entry.event is (own == ["from_s", "to_s"])
    assert set(entry.phases) == {name for name in own if name.endswith("phase_rad")}
    assert set(entry.phases.values()) <= {parameter.name for parameter in entry.shared_parameters}


@entries
def test_own_parameters_stand_last_and_may_be_left_out(entry: Effect) -> None:
    assert entry.parameters == entry.shared_parameters + entry.own_parameters
    assert all(parameter.optional for parameter in entry.own_parameters)


@entries
def test_what_it_resembles_resembles_it(entry: Effect) -> None:
    for group in ("resembles", "equivalent"):
        for other in getattr(entry, group):
            assert entry.name in getattr(EFFECTS[other], group), f"{other} does not name {entry.name} in {group}"


@entries
def test_every_entry_has_its_law_in_the_simulation(entry: Effect) -> None:
    """What is recognised in the raw data, and a profile over time, have no law there."""
    if entry.profile or entry.element is Element.ACQUISITION:
        return
    taken = {value for name, value in vars(slots).items() if name.isupper()} | set(torque_path._WRITTEN)
    missing = [each.name for each in entry.parameters if slot(entry.name, each.name) not in taken]
    assert entry.acting is not None or not missing, (
        f"{entry.name}: the simulation does not read {', '.join(missing)}. Give the entry acting=Acting(place, law) "
        "(estimator/physics/effect.py), or a place in estimator/physics/kernel/slots.py and the law that reads it."
    )


@entries
def test_a_declared_law_takes_the_parameters_of_its_entry(entry: Effect) -> None:
    if entry.acting is None:
        return
    law = getattr(entry.acting.law, "py_func", entry.acting.law)
    given = 2 if entry.acting.place in (Place.TORQUE, Place.SHAFT_LOSS) else 1
    takes = len(inspect.signature(law).parameters)
    assert takes == given + len(entry.parameters), (
        f"{entry.name}: its law takes {takes} arguments, expected {given} for its place and one per parameter: "
        f"{', '.join(each.name for each in entry.parameters)}"
    )


@entries
def test_a_clear_reversal_can_tell_every_effect(entry: Effect, reversal: Record, forward: Record) -> None:
    """With a gear by which the load makes a whole turn in it."""
    if entry.name == "torque_nonlinearity":  # of torques of one size there is a gain
        return
    line = replace(GEARED, gear_ratio=0.5)
    assert entry.testable(line, [reversal]) is None
    if entry.name != "inverter_gain_mismatch":  # which needs two inputs in every recording
        assert entry.testable(line, [forward, reversal]) is None


@pytest.mark.parametrize(
    ("name", "reason", "test"),
    [
        ("coulomb_friction_motor", "the speed never changes sign", "reversal"),
        ("stribeck_friction", "the speed never changes sign", "reversal"),
        ("backlash", "the shaft torque never changes sign", "reversal"),
        ("road_grade", "every recording is shorter than 8 s", "cruise"),
        ("coulomb_friction_load", "the speed never changes sign", "reversal"),
        ("quadratic_friction", "the speed is the same all along", "reversal"),
        ("aerodynamic_drag", "the speed is the same all along", "reversal"),
        ("torque_ripple", "the speed hardly changes", "reversal"),
        ("cardan_second_order", "the speed hardly changes", "reversal"),
        ("speed_sign_blind", "the speed stays clear of standstill", "reversal"),
        ("load_imbalance", "the model file has no [geometry] gear_ratio", "reversal"),
        ("eddy_drag", "the speed hardly varies", "reversal"),
        ("asymmetric_friction", "the speed never changes sign", "reversal"),
        ("gear_losses", "torque or speed never change sign", "reversal"),
        ("torque_nonlinearity", "the torque is always of about one size", "reversal"),
        ("torque_bias", "every recording is shorter than 8 s", "cruise"),
        ("inverter_gain_mismatch", "there is one torque input only", "cruise"),
    ],
)
def test_what_a_recording_can_not_tell_is_refused_with_the_test_that_would(
    name: str, reason: str, test: str, forward: Record
) -> None:
    obstacle = EFFECTS[name].testable(model(TWO_MASS), [forward])
    assert obstacle is not None
    assert obstacle.reason.startswith(reason)
    assert obstacle.suggested_test == test
    assert test in EXPERIMENTS


def test_two_inverters_with_the_same_share_all_along_can_not_be_distinguished(reversal: Record) -> None:
    total = reversal.torque_nm.sum(axis=1)
    entry = EFFECTS["inverter_gain_mismatch"]
    same = replace(reversal, torque_nm=np.column_stack([0.6 * total, 0.4 * total]))
    other = replace(reversal, torque_nm=np.column_stack([0.4 * total, 0.6 * total]))
    obstacle = entry.testable(GEARED, [same])
    assert obstacle is not None
    assert obstacle.reason.startswith("both inverters carry the same share")
    assert obstacle.suggested_test in EXPERIMENTS
    assert entry.testable(GEARED, [same, other]) is None


@pytest.mark.parametrize("name", ["actuator_lag", "transport_delay", "stiffness_nonlinearity"])
def test_what_any_recording_can_tell_is_not_refused(name: str, forward: Record) -> None:
    assert EFFECTS[name].testable(model(TWO_MASS), [forward]) is None


@entries
def test_every_field_for_people_is_filled(entry: Effect) -> None:
    for text in (entry.title, entry.law, entry.source, entry.excited_by, *(p.meaning for p in entry.parameters)):
        assert len(text) > 3
    assert entry.title != entry.name
    assert re.search(r"\d", entry.source)


def test_what_acts_in_or_behind_the_shaft_needs_one() -> None:
    """Friction at the load of a single mass is friction at the motor; a tyre needs two sides to slip between."""
    behind = {"coulomb_friction_load", "tyre_slip"}
    for entry in EFFECTS.values():
        assert {Structure.TWO_MASS, Structure.THREE_MASS} <= entry.structures
        needs = entry.element is Element.SHAFT or entry.name in behind
        assert (Structure.ONE_MASS in entry.structures) is not needs


def test_what_recurs_with_an_angle_needs_a_whole_period() -> None:
    """Over less it is any law of the angle, such as gravity."""
    swing = record(random_steps(1000, 1), 0.3 * np.sin(0.02 * np.arange(1000)), kind=OutputKind.POSITION)
    for name, least in (("cardan_second_order", "half a turn"), ("load_imbalance", "a whole turn")):
        obstacle = EFFECTS[name].testable(GEARED, [swing])
        assert obstacle is not None
        assert f"less than {least}" in obstacle.reason
    orders = {
        start[2].value for start in EFFECTS["torque_ripple"].starts(GEARED, [swing]) if isinstance(start[2], Held)
    }
    assert min(orders) == 12.0  # 0.6 rad are 0.095 turns
    assert {"gravity", "grounded_spring"} <= set(open_hypotheses(GEARED, [swing])[0])


@pytest.mark.parametrize("name", ["gravity", "grounded_spring"])
def test_what_holds_a_load_that_swings_is_no_hypothesis_where_it_turns_on(name: str) -> None:
    driven = record(random_steps(1000, 1), np.full(1000, 90.0))
    testable, untestable = open_hypotheses(GEARED, [driven])
    assert name not in testable
    assert name not in untestable


def test_gravity_may_have_a_larger_moment_than_all_torque_on_a_small_arc_only() -> None:
    torque = np.full(1000, 5.0)
    for swing_rad, expected in ((0.6, True), (9.0, False)):
        to_and_fro = record(torque, 0.5 * swing_rad * np.sin(0.05 * np.arange(1000)), kind=OutputKind.POSITION)
        found = EFFECTS["gravity"].implausible(GEARED, [to_and_fro], {"moment_nm": 50.0, "motor_turns_per_turn": 1.0})
        assert (not found) is expected
