"""Colours of pages and figures, distinguished by people with any common colour blindness.

The set of M. Okabe and K. Ito (Color Universal Design, 2008) without its yellow, which can't be seen on white, and the
wine red and indigo of P. Tol's "muted" set. Lines and points differ in dash, mark or number, too: nothing
is said by colour alone. `tests/figures/test_numbers.py` holds the differences in simulated colour blindness.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from estimator.signals.record import FloatArray

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

POINTS = 240

SPIRAL_DAMPINGS = (0.1, 0.3, 0.6)
"""Damping ratios whose lines are drawn."""


def series_colour(number: int) -> str:
    """Return the colour of one of several alike, counted from 0."""
    return SERIES[number % len(SERIES)]


def faded(colour: str, opacity: float) -> str:
    """Return a colour ``#rrggbb`` as CSS with an opacity of 0 to 1, for bands and areas."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity:g})"


def unit_circle() -> tuple[FloatArray, FloatArray]:
    """Return x and y of the circle of stability, shape (M,) each."""
    turn = np.linspace(0.0, 2.0 * np.pi, POINTS)
    return np.cos(turn), np.sin(turn)


def damping_lines() -> Iterator[tuple[float, FloatArray, FloatArray]]:
    """Yield lines of one damping ratio: the ratio, x and y of both conjugate halves with a gap between.

    ``z = exp(s T)`` with ``s = w (-d + i sqrt(1 - d^2))``: as the frequency rises to Nyquist's the angle goes to pi.
    """
    angle = np.linspace(0.0, np.pi, POINTS)
    for damping in SPIRAL_DAMPINGS:
        z = np.exp(angle * (1j - damping / np.sqrt(1.0 - damping**2)))
        both = np.concatenate([z, [np.nan], np.conj(z)])
        yield damping, both.real, both.imag


def frequency_marks(sample_time_s: float) -> Iterator[tuple[float, complex]]:
    """Yield frequencies [Hz] and the points of the unit circle they belong to, about five up to Nyquist's."""
    nyquist_hz = 0.5 / sample_time_s
    step_hz = _round_step(nyquist_hz / 5.0)
    for number in range(1, int(np.ceil(nyquist_hz / step_hz))):
        frequency_hz = number * step_hz
        yield frequency_hz, complex(np.exp(2j * np.pi * frequency_hz * sample_time_s))


def _round_step(about: float) -> float:
    """Return the number of 1, 2, 2.5 or 5 times a power of ten that is nearest above."""
    decade = 10.0 ** np.floor(np.log10(about))
    return float(next(step * decade for step in (1.0, 2.0, 2.5, 5.0, 10.0) if step * decade >= about * (1 - 1e-9)))
