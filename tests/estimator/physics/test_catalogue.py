"""One contract for every entry of the catalogue: names, units, nulls, starts, words, and what it refuses to judge."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import open_hypotheses
from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import InitialCondition, Structure
from estimator.physics.effect import Effect, Element, Held, Place
from estimator.physics.kernel import slots
from estimator.physics.kernel.laws_at import GIVEN
from estimator.physics.layout import flat, flat_values, grid_for, slot
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

# The last part of a parameter's name, and the units it may stand for (rotation).

# Parameters of a turning machine alone: their unit is an angle whatever the motion is called.

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
    rec = linear_record(TWO_MASS, torque, InitialCondition(0.0, 0.0, 0.5, 0.0, 0.5), sigma=0.02)
    share = np.where(np.arange(1000) < 500, 0.5, 0.7)
    return replace(rec, torque_nm=np.column_stack([share * torque, (1.0 - share) * torque]))


@pytest.fixture(scope="module")
def forward() -> Record:
    """Torque of one sign and a speed that hardly changes, too short for a road."""
    torque = random_steps(500, seed=2, size_nm=20.0, mean_nm=60.0)
    return linear_record(TWO_MASS, torque, InitialCondition(10.0, 0.0, 40.0, 0.0, 40.0))


EXPERIMENTS = frozenset({"cruise", "reversal", "tip"})
"""Kinds of experiment that ``hil run`` knows; a suggested test must be one (tests/docs compare the two)."""


def output_with(entry: Effect, values: Mapping[str, float], rec: Record) -> FloatArray:
    p = flat_values(TWO_MASS, {entry.name: values})
    return simulate(grid_for(model(TWO_MASS), [rec]), rec, p, InitialCondition(5.0, 0.0, 0.5, 0.0, 0.5))


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


@entries
def test_it_names_only_effects_of_the_catalogue(entry: Effect) -> None:
    for group in (entry.resembles, entry.equivalent, entry.contains):
        assert set(group) <= EFFECTS.keys(), f"{entry.name} names effects that have no entry"
        assert len(set(group)) == len(group)
        assert entry.name not in group
    assert set(entry.equivalent) <= set(entry.resembles)
    assert set(entry.contains) <= set(EFFECTS)


@laws
def test_null_parameters_leave_the_simulation_bit_equal(entry: Effect, reversal: Record) -> None:
    nominal = simulate(
        grid_for(model(TWO_MASS), [reversal]),
        reversal,
        flat(model(TWO_MASS)),
        InitialCondition(5.0, 0.0, 0.5, 0.0, 0.5),
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
        "torque_nonlinearity",
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
def test_the_null_of_the_decisive_parameter_can_be_reached(entry: Effect) -> None:
    """Others may stop short of theirs; a limit that nothing reaches is as good as none."""
    first = entry.parameters[0]
    assert first.low <= first.null <= first.high or first.null == math.inf
    for parameter in entry.parameters:
        assert parameter.low < parameter.high


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
    taken = {value for name, value in vars(slots).items() if name.isupper()}
    missing = [each.name for each in entry.parameters if slot(entry.name, each.name) not in taken]
    assert entry.acting is not None or not missing, (
        f"{entry.name}: the simulation does not read {', '.join(missing)}. Give the entry acting=Acting(place, law) "
        "(estimator/physics/effect.py), or a place in estimator/physics/kernel/slots.py and the law that reads it."
    )


@entries
def test_a_law_has_a_state_where_its_place_has_laws_with_one(entry: Effect) -> None:
    """The simulation adds up the shaft's laws with a state alone, and no laws with a state at other places."""
    if entry.acting is not None:
        allowed = {Place.SHAFT: (True,), Place.MOTOR: (True, False), Place.LOAD: (True, False)}
        assert (entry.acting.rate is not None) in allowed.get(entry.acting.place, (False,))
        assert entry.acting.course is None or entry.name == "torque_derating"  # driveline.c has no other course
        assert entry.acting.course is None or any(each.outlasts for each in entry.parameters)
        assert entry.acting.of_sum is None or entry.acting.place is Place.INVERTER


CHANGING = {
    **dict.fromkeys(
        (Place.MOTOR_INERTIA, Place.LOAD_INERTIA, Place.STIFFNESS, Place.LOAD_DAMPING, Place.LOAD_DRY), "time_s"
    ),
    **dict.fromkeys((Place.DRIVE_ANGLE, Place.CARDAN, Place.RECORDED_ANGLE), "angle"),
}
"""What a law is given that changes during a recording, at places whose laws are not worked out at every step."""


@released
def test_a_law_that_changes_all_the_time_is_worked_out_at_every_step(entry: Effect, reversal: Record) -> None:
    if entry.acting is None or entry.acting.place not in CHANGING:
        return
    given, changing = GIVEN[entry.acting.place], CHANGING[entry.acting.place]
    for start in start_values(entry, [reversal]):
        values = {each.name: each.null for each in entry.parameters} | start
        early, late = (
            entry.acting.law(*(moment if each == changing else 0.7 for each in given), *values.values())
            for moment in (0.4, 2.9)
        )
        assert entry.waving or entry.event or early == late, (
            f"{entry.name} needs waving=True: it changes with {changing}"
        )


@entries
def test_a_law_over_the_recorded_angle_has_a_phase(entry: Effect) -> None:
    """Without one no angle is worked out."""
    if entry.acting is not None and CHANGING.get(entry.acting.place) == "angle":
        assert entry.phases, f"{entry.name} is always given the angle 0"


@entries
def test_a_law_acts_in_every_structure_that_it_names(entry: Effect) -> None:
    """A joint on a bench has a simulation of its own (estimator/physics/joint.py)."""
    if Structure.JOINT in entry.structures and entry.acting is not None and entry.name != "shaft_hysteresis":
        assert entry.acting.place in (Place.STIFFNESS, Place.SPRING), f"{entry.name} does nothing in a joint"


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
