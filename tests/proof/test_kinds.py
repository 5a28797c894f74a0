"""What is hidden in a set: the same for the same seed, every group among many; the pairs."""

from collections import Counter

import pytest

from hil.proof.kinds import PAIRS, SHARES, Group, draw, kind
from hil.proof.seal import verify
from hil.proof.sealed_rig import CONCEALED, draw_challenge
from hil.proof.truth.specimen import choose_effect, draw_specimen


def test_equal_seeds_draw_the_same_and_more_cases_begin_as_fewer_do() -> None:
    assert draw(12, 7)[:5] == draw(5, 7)
    assert draw(5, 7) != draw(5, 8)


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


def test_the_seed_decides_and_the_commitment_does_not_tell():
    one, other = draw_challenge(7), draw_challenge(7)
    assert one.specimen == other.specimen
    assert one.seal.commitment != other.seal.commitment
    assert verify(one.seal.commitment, one.seal.opened())["effect"] == one.specimen.effect


def test_each_effect_is_drawn_about_as_often():
    drawn = Counter(choose_effect(CONCEALED, seed) for seed in range(800))
    assert set(drawn) == set(CONCEALED)
    assert min(drawn.values()) > 60  # 100 expected, 4 sigma is 37
