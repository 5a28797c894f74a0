"""How places of the chain, and laws without a name, are said in a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.effect import Element

PLACE_NAMES: Mapping[Element, str] = {
    Element.TORQUE_PATH: "torque path",
    Element.MOTOR: "motor side",
    Element.SHAFT: "shaft",
    Element.LOAD: "load side",
    Element.SPEED_SENSOR: "speed reading",
    Element.ACQUISITION: "acquisition",
}

MOST_TERMS = 3
"""Of a law without a name that are told in a sentence."""

ARTICLES = ("a ", "the ")
"""With one of these a term begins that is a phrase; all others are formulas."""


def is_phrase(name: str) -> bool:
    """Tell whether a term's name is a phrase and no formula."""
    return name.startswith(ARTICLES)


def law_in_words(terms: Sequence[tuple[str, float]]) -> str:
    """Return the first terms of a law: a formula with its coefficient, a phrase as it is."""
    said = ""
    for name, coefficient in terms[:MOST_TERMS]:
        if is_phrase(name):
            said += f" and {name}" if said else name
        else:
            sign = "-" if coefficient < 0.0 else "+" if said else ""
            said += f" {sign} " if said else sign
            said += f"{abs(coefficient):.3g} {name}"
    return said


def times(ratio: float) -> str:
    """Return a multiple to three digits as people write it: 281 and not 2.81e+02."""
    return f"{float(f'{ratio:.3g}'):.0f}" if ratio >= 100.0 else f"{ratio:.3g}"
