"""An independent two-mass driveline for the tests: exact discretisation by scipy, nothing of this project."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.signal import max_len_seq

from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import LIGHTLY_DAMPED, UncertainMode, uncertain_modes
from estimator.signals.record import FloatArray, Record

J_M, J_L, K, C, B_M, B_L = 1.6, 100.0, 4200.0, 9.0, 0.35, 0.9
SAMPLE_TIME_S = 0.01


@dataclass(frozen=True)
class Line:
    """A two-mass driveline from a moment on."""

    from_s: float = 0.0
    k: float = 4200.0
    J_L: float = 100.0
    J_M: float = 1.6
    c: float = 9.0
    b_motor: float = 0.35
    b_load: float = 0.9

    @property
    def matrix(self) -> FloatArray:
        """A of dx/dt = A x + B [T, T_0], x = [w_M, w_L, phi_M - phi_L]."""
        return np.array(
            [
                [-(self.c + self.b_motor) / self.J_M, self.c / self.J_M, -self.k / self.J_M],
                [self.c / self.J_L, -(self.c + self.b_load) / self.J_L, self.k / self.J_L],
                [1.0, -1.0, 0.0],
            ]
        )

    @property
    def resonance(self) -> tuple[float, float]:
        """Natural frequency [Hz] and damping ratio of the oscillating pair."""
        poles = np.linalg.eigvals(self.matrix)
        pole = poles[np.argmax(poles.imag)]
        return abs(pole) / (2 * np.pi), -pole.real / abs(pole)

    def discrete(self, sample_time_s: float = SAMPLE_TIME_S) -> tuple[FloatArray, FloatArray]:
        """Exact zero-order-hold discretisation by the exponential of [[A, B], [0, 0]] T."""
        block = np.zeros((5, 5))
        block[:3, :3] = self.matrix
        block[:3, 3:] = [[1.0 / self.J_M, 0.0], [0.0, -1.0 / self.J_L], [0.0, 0.0]]
        exponential = expm(block * sample_time_s)
        return exponential[:3, :3], exponential[:3, 3:]


LINE = Line()


def true_resonance() -> tuple[float, float]:
    """Natural frequency [Hz] and damping ratio of the tests' driveline."""
    return LINE.resonance


@dataclass(frozen=True)
class Cruise:
    """A drive at near-constant speed with PRBS, and what it was made of."""

    record: Record
    resonance_hz: float
    damping: float


def cruise(
    seed: int,
    duration_s: float = 22.0,
    noise_rad_s: float = 0.05,
    prbs_nm: float = 60.0,
    name: str = "cruise",
    line: Line = LINE,
    test_nm: FloatArray | None = None,
) -> Cruise:
    """Simulate a cruise: torque for the mean load plus PRBS or ``test_nm``, varying load torque, noisy resolver."""
    rng = np.random.default_rng(seed)
    n = round(duration_s / SAMPLE_TIME_S)
    t = SAMPLE_TIME_S * np.arange(n)
    sequence = 2.0 * np.resize(max_len_seq(10, state=rng.permutation([1] * 5 + [0] * 5))[0], n) - 1.0
    load = 150.0 + 30.0 * np.sin(2 * np.pi * 0.05 * t + rng.uniform(0, 6)) + np.cumsum(rng.normal(0, 0.5, n))
    torque = 300.0 + (prbs_nm * sequence if test_nm is None else test_nm)
    Ad, Bd = line.discrete()
    x = np.array([120.0, 120.0, 150.0 / line.k])
    speed = np.empty(n)
    for k in range(n):
        speed[k] = x[0]
        x = Ad @ x + Bd @ np.array([torque[k], load[k]])
    quantum = 0.6
    share = np.round(torque / 2 / quantum) * quantum
    record = Record(
        name=name,
        sample_time_s=SAMPLE_TIME_S,
        time_s=t,
        torque_nm=np.column_stack([share, share]),
        output=speed + rng.normal(0, noise_rad_s, n),
        okay=np.ones(n, dtype=bool),
    )
    return Cruise(record, *line.resonance)


def uncertain_resonance(model: LinearModel, covariance: FloatArray) -> UncertainMode | None:
    """Return the lightly damped pair of the highest peak between 2 and 25 Hz, with its intervals."""
    for found in uncertain_modes(model, covariance):
        if 2.0 <= found.frequency_hz.value <= 25.0 and abs(found.damping.value) < LIGHTLY_DAMPED:
            return found
    return None
