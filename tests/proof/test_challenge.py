"""What a challenge conceals follows from its seed alone, and each effect has its turn."""

from collections import Counter

import pytest

from hil.errors import UsageError
from hil.proof.seal import verify
from hil.proof.sealed_rig import CONCEALED, draw_challenge
from hil.proof.truth.specimen import EFFECTS, choose_effect, draw_specimen


def test_the_seed_decides_and_the_commitment_does_not_tell():
    one, other = draw_challenge(7), draw_challenge(7)
    assert one.specimen == other.specimen
    assert one.seal.commitment != other.seal.commitment
    assert verify(one.seal.commitment, one.seal.opened())["effect"] == one.specimen.effect


def test_each_effect_is_drawn_about_as_often():
    drawn = Counter(choose_effect(CONCEALED, seed) for seed in range(800))
    assert set(drawn) == set(CONCEALED)
    assert min(drawn.values()) > 60  # 100 expected, 4 sigma is 37


def test_only_what_the_catalogue_holds_is_concealed():
    assert all(EFFECTS[name].catalogued for name in CONCEALED)


def test_an_effect_can_be_asked_for():
    assert draw_challenge(7, "backlash").plant.physics.gap_rad > 0.0


def test_the_driveline_stands_still_before_it_is_driven():
    assert draw_challenge(7).plant.speed_rad_s == 0.0


def test_a_negative_seed_is_refused():
    with pytest.raises(UsageError, match="seed: expected 0 or greater, got -1"):
        draw_specimen("none", -1)
