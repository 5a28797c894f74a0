"""Dirty worlds: small things that are small, one that is not, and disturbances with a colour."""

import numpy as np
import pytest

from hil.proof.truth.recording import USUAL, speed_reading
from hil.proof.truth.specimen import EFFECTS, draw_specimen
from tests.campaigns.dirty import (
    FEWEST,
    IMPERFECTIONS,
    LEAST_PART,
    MOST,
    MOST_PART,
    Known,
    in_a_model_file,
    make_dirty,
    strength_of,
)


@pytest.mark.parametrize(("strong", "seed"), [("brake_drag", 1), ("actuator_lag", 2), ("none", 3)])
def test_small_effects_are_some_and_small_and_not_the_strong_one_again(strong: str, seed: int) -> None:
    case, known = make_dirty(strong, seed)
    small = {name: sizes for name, sizes in case.specimen.sizes.items() if name != strong}
    assert FEWEST <= len(small) <= MOST
    assert set(small) <= set(IMPERFECTIONS)
    assert known == {}
    assert case.specimen.sizes[strong] == draw_specimen(strong, seed).sizes[strong]
    for name, sizes in small.items():
        whole = draw_specimen(name, seed).sizes[name]
        for key in strength_of(name, whole):
            assert LEAST_PART * abs(whole[key]) <= abs(sizes[key]) <= MOST_PART * abs(whole[key])


@pytest.mark.parametrize("known", list(Known))
def test_the_model_file_knows_what_it_is_to_know(known: Known) -> None:
    case, stated = make_dirty("none", 6, known)
    sizes = case.specimen.sizes
    true = {
        (name, word): sizes[name][size]
        for name in sizes
        for word, size in in_a_model_file(EFFECTS[name], sizes[name]).items()
        if known is not Known.NONE
    }
    assert {(name, word) for name, words in stated.items() for word in words} == set(true)
    for (name, word), value in true.items():
        assert stated[name][word] == pytest.approx(value, rel=0.15 if known is Known.OFF else 1e-12)
    if known is Known.OFF:
        assert any(stated[name][word] != value for (name, word), value in true.items())


def test_a_sensor_without_colour_draws_what_it_always_drew() -> None:
    """Cases that were made before sensors had a colour stay the same to the last digit."""
    rng, again = np.random.default_rng(2), np.random.default_rng(2)
    np.testing.assert_array_equal(speed_reading(np.zeros(50), rng, USUAL), again.normal(0.0, 0.05, 50))
    assert rng.random() == again.random()
