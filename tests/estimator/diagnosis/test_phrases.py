"""Phrases: a formula has its coefficient, what is said in words has none; every element has its place."""

from __future__ import annotations

import pytest

from estimator.diagnosis.phrases import PLACE_NAMES, is_phrase, law_in_words
from estimator.diagnosis.unnamed.laws import LAWS
from estimator.physics.effect import Element

A_PHRASE, A_FORMULA = ("a function of T", 27.5), ("T^3", -3.22e-7)


@pytest.mark.parametrize(
    ("terms", "said"),
    [
        ([A_FORMULA], "-3.22e-07 T^3"),
        ([A_PHRASE], "a function of T"),
        ([A_PHRASE, A_FORMULA], "a function of T - 3.22e-07 T^3"),
        ([A_FORMULA, A_PHRASE], "-3.22e-07 T^3 and a function of T"),
        ([("|w|", 2.0), ("w", 1.5), ("w^3", -1.0), ("dw/dt", 9.0)], "2 |w| + 1.5 w - 1 w^3"),  # the first three
    ],
)
def test_a_law_is_a_readable_sum(terms: list[tuple[str, float]], said: str) -> None:
    assert law_in_words(terms) == said


@pytest.mark.parametrize("element", Element)
def test_every_element_has_a_place(element: Element) -> None:
    assert PLACE_NAMES[element]


@pytest.mark.parametrize("name", sorted({name for laws in LAWS.values() for name in laws}))
def test_what_needs_words_is_a_phrase(name: str) -> None:
    """A formula has no word of more than five letters but those of its own functions and signals."""
    words = [word.strip("()|^-/") for word in name.split()]
    in_words = any(word.isalpha() and len(word) > 5 for word in words)
    assert is_phrase(name) is in_words
