"""How places of the chain, and laws without a name, are said in a sentence.

A law is said by what it depends on: its formula stands in the report's tables.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from estimator.physics.effect import Element

PLACE_NAMES: Mapping[Element, str] = {
    Element.TORQUE_PATH: "in the torque path",
    Element.MOTOR: "at the motor",
    Element.SHAFT: "in the shaft",
    Element.LOAD: "at the load",
    Element.SPEED_SENSOR: "in the reading",
    Element.ACQUISITION: "in the acquisition",
}

MOST_TERMS = 3
"""At most so many terms of a law are said."""

ARTICLES = ("a ", "the ")
"""With one of these a term begins that is a phrase; all others are formulas."""

FUNCTION = "a function of "

_SIGNALS: Mapping[str, str] = {
    "d twist/dt": "how fast the twist changes",
    "dw_M/dt": "the motor's acceleration",
    "dw_L/dt": "the load's acceleration",
    "dw/dt": "the acceleration",
    "twist": "the twist",
    "w_M": "the motor speed",
    "w_L": "the load speed",
    "w": "the speed",
    "T": "the torque",
    "t": "the time",
}
_INPUT = re.compile(r"T_(\d+)")
_SIGNAL = re.compile("|".join([_INPUT.pattern, *(rf"(?<!\w){re.escape(name)}(?!\w)" for name in _SIGNALS)]))


def is_phrase(name: str) -> bool:
    """Tell whether a term's name is a phrase and no formula."""
    return name.startswith(ARTICLES)


def law_in_words(element: Element, terms: Sequence[tuple[str, float]]) -> str:
    """Say a law by what it depends on, as the end of a sentence that begins with "it".

    One that is a wrong scale, or a reading that is late, is said as such.
    """
    alike = _as_if(element, *terms[0]) if len(terms) == 1 else ""
    if alike:
        return alike
    signals = list(dict.fromkeys(word for name, _ in terms[:MOST_TERMS] for word in _signals_of(name)))
    others = [name for name, _ in terms[:MOST_TERMS] if not _signals_of(name)]
    said = [f"depends on {_listed(signals)}"] if signals else []
    said += [f"looks like {_listed(others)}"] if others else []
    return f"{' and '.join(said)}, {PLACE_NAMES[element]}"


def _as_if(element: Element, name: str, coefficient: float) -> str:
    """Say a single term as what it would be; "" where it is nothing that has a name."""
    size = f"{100.0 * abs(coefficient):.3g} %"
    if (element, name) == (Element.SPEED_SENSOR, "w"):
        return f"looks as if the speed read {size} {'high' if coefficient > 0.0 else 'low'}"
    if (element, name) == (Element.SPEED_SENSOR, "dw/dt"):
        side = "late" if coefficient < 0.0 else "early"
        return f"looks as if the speed were read {1e3 * abs(coefficient):.3g} ms {side}"
    if (element, name) == (Element.TORQUE_PATH, "T"):
        return f"looks as if the torque were {size} {'above' if coefficient > 0.0 else 'below'} its reading"
    return ""


def _signals_of(name: str) -> list[str]:
    """Return the signals that a formula, or a function of one, depends on; none of a phrase."""
    if is_phrase(name) and not name.startswith(FUNCTION):
        return []
    found = (match.group() for match in _SIGNAL.finditer(name.removeprefix(FUNCTION)))
    return [_INPUT.sub(r"the torque of input \1", word) if _INPUT.match(word) else _SIGNALS[word] for word in found]


def _listed(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def times(ratio: float) -> str:
    """Return a multiple to three digits as people write it: 281 and not 2.81e+02."""
    return f"{float(f'{ratio:.3g}'):.0f}" if ratio >= 100.0 else f"{ratio:.3g}"
