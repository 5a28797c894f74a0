"""The numbers of the figures, and the band they are taken in."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from estimator.identification.identify import identify
from hil.figures.local_model import LocalModel, Reference, TwoMassLine, row_of
from hil.figures.palette import BLACK, BLUE, GREEN, GREY, PURPLE, SERIES, VERMILION
from tests.estimator.identification.driveline import B_L, B_M, J_L, J_M, LINE as TRUTH, C, K, cruise, true_resonance

LINE = TwoMassLine(J_M, J_L, K, C, B_M, B_L)


@pytest.fixture(scope="module")
def model() -> LocalModel:
    record = cruise(3).record
    return LocalModel(record, identify(record), Reference("truth", LINE))


def test_a_row_holds_errors_to_the_reference(model: LocalModel) -> None:
    row = row_of(model)
    frequency_hz, damping = true_resonance()
    assert (row.reference_hz, row.reference_damping) == pytest.approx((frequency_hz, damping))
    assert row.error("hz", "online") == pytest.approx(row.online_hz / frequency_hz - 1.0)
    assert abs(row.error("hz", "online")) < 0.02
    assert abs(row.error("damping", "offline")) < 0.15
    assert row.status == "estimated"
    assert 0.0 <= row.offline_db < math.inf


def test_the_band_is_one_stretch_around_the_resonance(model: LocalModel) -> None:
    f = model.coherent_hz
    spectral = model.found.spectral
    assert spectral is not None
    assert f.min() < true_resonance()[0] < f.max()
    inside = np.isin(spectral.frequency_hz, f)
    assert (np.diff(np.flatnonzero(inside)) == 1).all()
    assert (spectral.coherence[inside] > 0.9).all()
    first, last = np.flatnonzero(inside)[[0, -1]]
    assert first == 0 or spectral.coherence[first - 1] <= 0.9
    assert last == inside.size - 1 or spectral.coherence[last + 1] <= 0.9


def test_without_resonance_spectrum_or_reference_there_are_no_such_numbers(model: LocalModel) -> None:
    bare = replace(model.found, spectral=None, online_resonance=None, batch_resonance=None)
    row = row_of(LocalModel(model.record, bare))
    for value in (row.online_hz, row.offline_damping, row.reference_hz, row.spectral_db, row.error("hz", "online")):
        assert math.isnan(value)


def test_the_third_order_equivalent_keeps_the_resonance(model: LocalModel) -> None:
    low = model.third_order
    assert low is not None
    assert len(low.a) == 3
    found = model.found.online_resonance
    assert found is not None
    z = max(low.poles, key=lambda pole: pole.imag)
    assert abs(np.log(z)) / (2 * np.pi * low.sample_time_s) == pytest.approx(found.frequency_hz, rel=0.02)


FIGURE_LINE = TwoMassLine.of({"J_M": J_M, "J_L": J_L, "k": K, "c": C, "b_M": B_M, "b_L": B_L})


def test_it_is_discretised_exactly() -> None:
    for mine, other in zip(FIGURE_LINE.discrete(0.01), TRUTH.discrete(0.01), strict=True):
        np.testing.assert_allclose(mine, other, rtol=1e-12, atol=1e-15)


def test_its_resonance_is_that_of_the_eigenvalues() -> None:
    mode = FIGURE_LINE.resonance
    assert mode is not None
    assert (mode.frequency_hz, mode.damping) == pytest.approx(true_resonance())


def test_a_torque_held_for_no_time_at_all_has_the_continuous_response() -> None:
    f = np.array([0.5, 1.03, 5.0, 8.2, 20.0])
    s = 2j * np.pi * f
    # eliminate w_L from the two equations of motion: w_M / T of the two-mass drive
    shaft = K / s + C
    load = J_L * s + B_L
    expected = 1.0 / (J_M * s + B_M + shaft * load / (shaft + load))
    np.testing.assert_allclose(FIGURE_LINE.response(f, 1e-6), expected, rtol=1e-4)


def test_the_response_vanishes_at_the_zeros_and_a_held_torque_comes_half_its_time_late() -> None:
    anti_hz = np.sqrt(K / J_L) / (2 * np.pi)
    around = np.abs(FIGURE_LINE.response(np.array([0.9 * anti_hz, anti_hz, 1.1 * anti_hz]), 0.01))
    assert around[1] < 0.5 * min(around[0], around[2])
    angle = np.angle(FIGURE_LINE.zeros(0.01)).max()
    assert angle == pytest.approx(2 * np.pi * anti_hz * 0.01, rel=0.01)
    f = np.array([4.0])
    lag = np.angle(FIGURE_LINE.response(f, 0.01) / FIGURE_LINE.response(f, 1e-6))[0]
    assert lag == pytest.approx(-np.pi * 4.0 * 0.01, rel=0.02)  # less what folds down from above 50 Hz


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
