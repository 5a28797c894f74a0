"""What a challenge conceals follows from its seed alone, and each effect has its turn."""

from collections import Counter

from hil.proof.seal import verify
from hil.proof.sealed_rig import CONCEALED, draw_challenge
from hil.proof.truth.specimen import choose_effect


def test_the_seed_decides_and_the_commitment_does_not_tell():
    one, other = draw_challenge(7), draw_challenge(7)
    assert one.specimen == other.specimen
    assert one.seal.commitment != other.seal.commitment
    assert verify(one.seal.commitment, one.seal.opened())["effect"] == one.specimen.effect


def test_each_effect_is_drawn_about_as_often():
    drawn = Counter(choose_effect(CONCEALED, seed) for seed in range(800))
    assert set(drawn) == set(CONCEALED)
    assert min(drawn.values()) > 60  # 100 expected, 4 sigma is 37
