"""Colours of lines differ for the colour-blind as well, and can be seen on white."""

from itertools import combinations

import numpy as np
import pytest

from hil.figures.palette import BLACK, BLUE, GREEN, GREY, PURPLE, SERIES, VERMILION

# Full loss of one kind of cone, linear RGB to linear RGB: G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, "A
# Physiologically-based Model for Simulation of Color Vision Deficiency", IEEE TVCG 15 (2009), table at severity 1.0.
DEFICIENCIES = {
    "none": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}

JUST_SEEN = 2.3
"""Difference in CIELAB that half of all observers see (M. Mahy and others, 1994)."""


def linear(colour: str) -> np.ndarray:
    """Return the linear RGB of ``#rrggbb`` (IEC 61966-2-1)."""
    c = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """Return CIELAB of linear RGB under D65."""
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    t = to_xyz @ np.clip(rgb, 0.0, 1.0) / np.array([0.9505, 1.0, 1.089])
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("sight", DEFICIENCIES)
@pytest.mark.parametrize(
    "together",
    [
        pytest.param(SERIES, id="the runs of a set"),
        pytest.param((BLUE, VERMILION, GREEN, BLACK), id="models and reference"),
        pytest.param((BLACK, GREEN, PURPLE), id="inputs"),
        pytest.param((VERMILION, BLUE, GREY), id="before, after, nominal"),
    ],
)
def test_no_two_lines_of_a_figure_look_alike_to_anybody(sight: str, together: tuple[str, ...]) -> None:
    seen = [lab(DEFICIENCIES[sight] @ linear(colour)) for colour in together]
    apart = min(float(np.linalg.norm(a - b)) for a, b in combinations(seen, 2))
    assert apart > 3 * JUST_SEEN


@pytest.mark.parametrize("colour", [BLUE, VERMILION, GREEN, BLACK, GREY])
def test_lines_stand_out_from_white(colour: str) -> None:
    luminance = float(np.array([0.2126, 0.7152, 0.0722]) @ linear(colour))
    assert 1.05 / (luminance + 0.05) >= 3.0  # WCAG 2.1, success criterion 1.4.11: graphical objects
