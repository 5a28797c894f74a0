import numpy as np
import pytest
from scipy.signal import lfilter, welch

from estimator.identification.offline.fits import fit_noise, sandwich

D = np.array([1.0, -1.5, 0.7])
N = 20_000


def coloured(seed: int, n: int = N) -> np.ndarray:
    return lfilter([1.0], D, np.random.default_rng(seed).normal(0, 0.3, n))


def test_the_autoregression_comes_back() -> None:
    noise = fit_noise(coloured(0), np.ones(N, dtype=bool), 2)
    np.testing.assert_allclose(noise.D, D, atol=0.02)
    assert noise.std == pytest.approx(0.3, rel=0.02)


def test_masked_samples_are_not_looked_at() -> None:
    okay = np.ones(N, dtype=bool)
    okay[np.random.default_rng(2).integers(0, N, 1500)] = False
    e = np.where(okay, coloured(3), np.nan)
    noise = fit_noise(e, okay, 2)
    np.testing.assert_allclose(noise.D, D, atol=0.03)
    complete = noise.complete(okay)
    assert not complete[:2].any()
    assert all(okay[k - 2 : k + 1].all() for k in np.flatnonzero(complete)[:200])


def test_it_is_stable_even_on_a_random_walk() -> None:
    walk = np.cumsum(np.random.default_rng(5).normal(size=2000))
    noise = fit_noise(walk, np.ones(2000, dtype=bool), 50)
    assert np.abs(np.roots(noise.D)).max() < 1.0


def test_its_spectrum_is_that_of_the_residual() -> None:
    e = coloured(6, 200_000)
    frequency_hz, density = welch(e, fs=100.0, nperseg=1024)
    model = fit_noise(e, np.ones(e.shape, dtype=bool), 2).spectrum(frequency_hz, 0.01)
    assert np.abs(10 * np.log10(model / density))[5:-5].max() < 1.5


def test_the_sandwich_is_the_scatter_of_least_squares_in_coloured_noise() -> None:
    rng = np.random.default_rng(7)
    n, okay = 600, np.ones(600, dtype=bool)
    okay[200:230] = False
    psi = np.column_stack([np.ones(n), lfilter([1.0], [1.0, -0.9], rng.normal(size=n))])
    noise = fit_noise(coloured(8), np.ones(N, dtype=bool), 2)
    said = sandwich(psi, okay, noise)
    scattered = [np.linalg.lstsq(psi[okay], coloured(seed, n + 200)[200:][okay])[0] for seed in range(100, 900)]
    # of 800 draws a standard deviation is known to 2.5 %; the correction for coefficients spent is 0.4 %
    np.testing.assert_allclose(np.sqrt(np.diag(said)), np.std(scattered, axis=0), rtol=0.1)
    plain = np.sqrt(np.diag(np.linalg.inv(psi[okay].T @ psi[okay]))) * np.std(coloured(8))
    assert (np.abs(plain / np.std(scattered, axis=0) - 1.0) > 0.3).any()  # what a white residual would have it
