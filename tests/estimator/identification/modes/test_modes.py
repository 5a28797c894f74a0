import numpy as np
import pytest
from scipy.signal import cont2discrete

from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import modes, resonance
from tests.estimator.identification import driveline

T_S = 0.02


def with_poles(*pairs: tuple[float, float], real: tuple[float, ...] = (), gain: float = 1.0) -> LinearModel:
    """Return a model with poles of these natural frequencies [Hz] and damping ratios."""
    s = [2 * np.pi * f * (-z + 1j * np.sqrt(1 - z**2)) for f, z in pairs]
    roots = np.concatenate([np.exp(np.array(s) * T_S), np.exp(np.conj(s) * T_S), real])
    a = np.real(np.poly(roots))[1:]
    return LinearModel(tuple(a.tolist()), (gain,), 1, T_S)


def test_frequency_and_damping_of_known_poles() -> None:
    first, second = sorted(modes(with_poles((8.2, 0.057), (15.0, 0.3))), key=lambda mode: mode.frequency_hz)
    assert (first.frequency_hz, first.damping) == (pytest.approx(8.2), pytest.approx(0.057))
    assert (second.frequency_hz, second.damping) == (pytest.approx(15.0), pytest.approx(0.3))


def test_the_discretised_two_mass_driveline_has_its_continuous_mode() -> None:
    system = (
        driveline.LINE.matrix,
        np.array([[1.0 / driveline.J_M], [0.0], [0.0]]),
        np.array([[1.0, 0.0, 0.0]]),
        np.zeros((1, 1)),
    )
    Ad, Bd, C, _, _ = cont2discrete(system, T_S)
    a = np.real(np.poly(Ad))
    b = np.real(np.poly(Ad - Bd @ C)) - a  # the numerator of C (zI - A)^-1 B
    model = LinearModel(tuple(a[1:].tolist()), tuple(b[1:].tolist()), 1, T_S)
    mode = resonance(model)
    assert mode is not None
    assert (mode.frequency_hz, mode.damping) == pytest.approx(driveline.true_resonance())


def test_the_dominant_mode_wins_not_the_first() -> None:
    mode = resonance(with_poles((6.0, 0.4), (12.0, 0.03)))
    assert mode is not None
    assert mode.frequency_hz == pytest.approx(12.0)


def test_a_cancelled_pair_does_not_win() -> None:
    pair = np.exp(T_S * 2 * np.pi * 14.0 * (-0.01 + 1j))
    true = with_poles((8.2, 0.057))
    poles = np.concatenate([true.poles, [pair, pair.conj()]])
    zeros = np.array([pair, pair.conj()]) * 1.0005
    model = LinearModel(tuple(np.real(np.poly(poles))[1:].tolist()), tuple(np.real(np.poly(zeros)).tolist()), 1, T_S)
    mode = resonance(model)
    assert mode is not None
    assert mode.frequency_hz == pytest.approx(8.2)


@pytest.mark.parametrize(
    "model",
    [
        with_poles((8.2, 0.6)),  # no peak
        with_poles((1.0, 0.05)),  # below the band
        with_poles(real=(0.99, 0.5)),
        with_poles(real=(-0.9,)),  # a real pole at the Nyquist frequency does not oscillate
        LinearModel((), (1.0,), 1, T_S),
        LinearModel((0.0, 0.0), (1.0, 0.5), 1, T_S),
    ],
)
def test_where_there_is_no_resonance_none_is_named(model: LinearModel) -> None:
    assert resonance(model) is None
