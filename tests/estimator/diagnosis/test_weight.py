"""Weight: a share of the mismatch counts, a small rest only where it can be no other law's own remainder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.weight import (
    MOST,
    PART_BESIDE,
    PART_FOR_DETAIL,
    PART_OF_MISMATCH,
    VISIBLE,
    Weight,
    earns_detail,
)
from tests.estimator.diagnosis.regression import of_rms

COULOMB = "coulomb_friction_motor"
RETUNED = of_rms(1.0, 2)
WEIGHT = Weight(floor=0.1)


@pytest.mark.parametrize(("after", "weighty"), [(0.95, True), (0.98, False), (0.1, True)])
def test_a_share_of_the_first_mismatch_has_weight(after: float, weighty: bool) -> None:
    """1 - 0.95^2 = 9.8 % of the power, 1 - 0.98^2 = 4.0 %; the floor holds 1 %."""
    assert PART_OF_MISMATCH == 0.05
    alone = frozenset({COULOMB})
    assert WEIGHT.counts(COULOMB, alone, of_rms(after, 3), RETUNED, RETUNED) is weighty


@pytest.mark.parametrize(
    ("before", "after", "visible"),
    [
        (0.12, 0.101, True),  # most of the rest that stands above the floor, 19 % of the RMS
        (0.12, 0.117, False),  # 2.6 % of the RMS
        (0.5, 0.47, False),  # 6 % of the RMS but a small part of what stands
    ],
)
def test_a_small_rest_counts_where_it_is_most_of_what_stands(before: float, after: float, visible: bool) -> None:
    assert VISIBLE == 1.05
    assert WEIGHT.visible(of_rms(before, 3), of_rms(after, 4)) is visible
    elsewhere = frozenset({COULOMB, "road_grade"})
    assert WEIGHT.counts(COULOMB, elsewhere, of_rms(after, 4), of_rms(before, 3), RETUNED) is visible


def test_a_small_rest_beside_an_effect_of_the_same_element_is_its_law_written_another_way() -> None:
    same = frozenset({"backlash", "stiffness_nonlinearity"})
    after, before = of_rms(0.101, 4), of_rms(0.12, 3)
    assert not WEIGHT.counts("stiffness_nonlinearity", same, after, before, RETUNED)
    assert WEIGHT.counts("stiffness_nonlinearity", same, of_rms(0.101, 4), of_rms(0.5, 3), RETUNED)


def test_a_small_wave_beside_a_wave_is_its_overtone() -> None:
    """Motor and load are two elements; alone beside friction the same rest would count."""
    after, before = of_rms(0.101, 4), of_rms(0.12, 3)
    assert not WEIGHT.counts("load_imbalance", frozenset({"torque_ripple", "load_imbalance"}), after, before, RETUNED)
    assert WEIGHT.counts("load_imbalance", frozenset({COULOMB, "load_imbalance"}), after, before, RETUNED)


@pytest.mark.parametrize(("after", "may_stand"), [(0.43, True), (0.47, False), (0.1, True)])
def test_an_explanation_may_stand_that_takes_four_fifths_away(after: float, may_stand: bool) -> None:
    """1 - 0.43^2 = 81.5 % of the power, 1 - 0.47^2 = 77.9 %; the floor holds 1 %."""
    assert MOST == 0.8
    assert WEIGHT.may_stand(of_rms(after, 3), RETUNED) is may_stand


def test_where_the_torque_is_an_estimate_a_gain_must_be_seen() -> None:
    """1 - 0.97^2 = 6 % of the mismatch is weight enough, but not where part of it was put in by a repair."""
    guessed = replace(WEIGHT, least_ratio=VISIBLE)
    alone = frozenset({COULOMB})
    assert WEIGHT.counts(COULOMB, alone, of_rms(0.97, 3), RETUNED, RETUNED)
    assert not guessed.counts(COULOMB, alone, of_rms(0.97, 3), RETUNED, RETUNED)
    assert guessed.counts(COULOMB, alone, of_rms(0.94, 3), RETUNED, RETUNED)


def test_detail_must_remove_a_share_of_what_the_special_case_removed() -> None:
    special = of_rms(0.2, 3)
    removed = 1.0 - 0.2**2
    edge = np.sqrt(0.2**2 - PART_FOR_DETAIL * removed)
    assert earns_detail(special, of_rms(0.99 * edge, 5), RETUNED)
    assert not earns_detail(special, of_rms(1.01 * edge, 5), RETUNED)


def test_a_small_rest_behind_a_profile_is_not_the_profile_written_another_way() -> None:
    """A profile is no law: its knots follow what is slow, and what else the load does is another's."""
    after, before = of_rms(0.101, 4), of_rms(0.12, 3)
    assert WEIGHT.counts("tyre_slip", frozenset({"road_grade", "tyre_slip"}), after, before, RETUNED)
    assert not WEIGHT.counts("road_grade", frozenset({"road_grade", "tyre_slip"}), after, before, RETUNED)


def test_a_small_wave_beside_a_law_of_its_element_is_no_echo_of_it() -> None:
    """No law of the twist leaves what is in step with the motor's angle; another law of the twist does."""
    after, before = of_rms(0.101, 4), of_rms(0.12, 3)
    for name, counts in (("cardan_second_order", True), ("stiffness_nonlinearity", False)):
        assert WEIGHT.counts(name, frozenset({"backlash", name}), after, before, RETUNED) is counts


def test_a_small_law_beside_a_wave_of_its_element_is_no_echo_of_it() -> None:
    """What is in step with an angle leaves no dry friction; another friction does, written another way."""
    after, before = of_rms(0.101, 4), of_rms(0.12, 3)
    for other, counts in (("load_imbalance", True), ("coulomb_friction_load", False)):
        assert (
            WEIGHT.counts("aerodynamic_drag", frozenset({other, "aerodynamic_drag"}), after, before, RETUNED) is counts
        )


def test_what_is_next_to_nothing_of_the_mismatch_is_not_told_from_the_law_that_explains_it() -> None:
    """All that stands above the noise, and visible; but of the first mismatch more or less than one in a thousand."""
    after, before = of_rms(0.101, 4), of_rms(0.12, 3)
    removed = 0.12**2 - 0.101**2
    for share, counts in ((1.1 * PART_BESIDE, True), (0.9 * PART_BESIDE, False)):
        retuned = of_rms(float(np.sqrt(removed / share + WEIGHT.floor**2)), 2)
        assert WEIGHT.counts(COULOMB, frozenset({"backlash", COULOMB}), after, before, retuned) is counts
