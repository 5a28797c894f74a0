"""Colours of pages and figures, distinguished by people with any common colour blindness.

The set of M. Okabe and K. Ito (Color Universal Design, 2008) without its yellow, which can't be seen on white, and the
wine red and indigo of P. Tol's "muted" set. Lines and points differ in dash, mark or number, too: nothing
is said by colour alone. `tests/figures/test_palette.py` holds the differences in simulated colour blindness.
"""

from __future__ import annotations

from typing import Final

BLUE: Final = "#0072b2"
VERMILION: Final = "#d55e00"
GREEN: Final = "#009e73"
PURPLE: Final = "#cc79a7"
ORANGE: Final = "#e69f00"
SKY: Final = "#56b4e9"
WINE: Final = "#882255"
INDIGO: Final = "#332288"

BLACK: Final = "#111111"
GREY: Final = "#666666"
PALE: Final = "#b4bac1"

SERIES: Final = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, WINE, INDIGO)
"""Colours of several alike, such as the runs of a set; more than eight begin again."""


def series_colour(number: int) -> str:
    """Return the colour of one of several alike, counted from 0."""
    return SERIES[number % len(SERIES)]


def faded(colour: str, opacity: float) -> str:
    """Return a colour ``#rrggbb`` as CSS with an opacity of 0 to 1, for bands and areas."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity:g})"
