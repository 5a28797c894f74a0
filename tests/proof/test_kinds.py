"""What is hidden in a set: the same for the same seed, every group among many; the pairs."""

from collections import Counter

import pytest

from hil.proof.kinds import NAMES, PAIRS, SHARES, Group, draw, kind
from hil.proof.truth.specimen import EFFECTS, draw_specimen


def test_equal_seeds_draw_the_same_and_more_cases_begin_as_fewer_do() -> None:
    assert draw(12, 7)[:5] == draw(5, 7)
    assert draw(5, 7) != draw(5, 8)


def test_names_tell_nothing() -> None:
    assert [each.name for each in draw(3, 1)] == ["case_001", "case_002", "case_003"]


def test_every_group_comes_about_as_often_as_it_should() -> None:
    """Five standard deviations of a binomial count."""
    cases = 600
    counts = Counter(each.kind.group for each in draw(cases, 3))
    assert sum(SHARES.values()) == pytest.approx(1.0)
    for group in Group:
        p = SHARES[group]
        assert counts[group] == pytest.approx(cases * p, abs=5.0 * (cases * p * (1.0 - p)) ** 0.5)


def test_no_two_cases_of_a_set_are_drawn_from_one_seed() -> None:
    assert len({each.seed for each in draw(200, 2)}) == 200


@pytest.mark.parametrize("pair", PAIRS)
def test_the_listed_pairs_are_of_the_catalogue_and_can_be_hidden_together(pair):
    assert kind(pair).group is Group.PAIR
    assert len(draw_specimen(pair, 1).effects) == 2


def test_every_effect_of_the_catalogue_is_in_some_pair_or_stands_alone_for_a_reason():
    paired = {name for pair in PAIRS for name in pair.split("+")}
    alone = {name for name, effect in EFFECTS.items() if effect.catalogued} - paired - {"none"}
    assert alone == {"quadratic_friction", "speed_sign_blind", "sample_jitter"}


def test_every_group_has_its_kinds():
    assert {each.group for group, names in NAMES.items() for each in map(kind, names)} == set(Group)
    assert all(kind(name).group is group for group, names in NAMES.items() for name in names)
    assert kind("none").nominal_error == 0.0 < kind("off").nominal_error
