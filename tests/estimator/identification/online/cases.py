"""For each estimator of the registry: a plant it can find, its samples, and how it is set up for them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.signal import ss2tf

from estimator.identification.linear_model import LinearModel
from estimator.identification.online.adaptation import Adaptation, DecreasingGain
from estimator.identification.online.ekf import TwoMass
from estimator.identification.online.estimators import ESTIMATORS, Setup
from estimator.identification.online.recursive import RecursiveEstimator
from estimator.signals.prbs import prbs_nm
from estimator.signals.record import BoolArray, FloatArray

Data = tuple[FloatArray, FloatArray, BoolArray]

LINEAR = LinearModel(a=(-1.2, 0.85), b=(0.5, 0.3), nk=1, sample_time_s=0.02)
TWO_MASS = TwoMass(J_M=1.6, J_L=40.0, k=4200.0, c=9.0)
PERIOD_S = 0.01
LOAD_NM = 80.0


@dataclass(frozen=True)
class Case:
    """One estimator with what it is to find."""

    name: str
    truth: FloatArray
    data: Callable[[int, float, int], Data]
    setup: Callable[[Adaptation], Setup]

    def make(self, adaptation: Adaptation | None = None) -> RecursiveEstimator:
        """Return a fresh estimator, with the decreasing gain unless another is given."""
        return ESTIMATORS[self.name](self.setup(adaptation or DecreasingGain()))


def linear_data(n: int, noise: float = 0.0, seed: int = 0) -> Data:
    u = prbs_nm(n, 1.0, seed=seed + 1)
    y = LINEAR.simulate(u) + noise * np.random.default_rng(seed).normal(size=n)
    return u, y, np.ones(n, dtype=bool)


def linear_setup(adaptation: Adaptation) -> Setup:
    return Setup(LINEAR.orders, LINEAR.sample_time_s, adaptation, L=LINEAR.A, start_up_samples=20)


def two_mass_discrete() -> tuple[FloatArray, FloatArray]:
    """Exact discretisation of (w_M, w_L, twist) under (torque, load torque), by the matrix exponential."""
    p = TWO_MASS
    block = np.zeros((5, 5))
    block[:3, :3] = [
        [-p.c / p.J_M, p.c / p.J_M, -p.k / p.J_M],
        [p.c / p.J_L, -p.c / p.J_L, p.k / p.J_L],
        [1.0, -1.0, 0.0],
    ]
    block[0, 3], block[1, 4] = 1.0 / p.J_M, -1.0 / p.J_L
    exponential = expm(block * PERIOD_S)
    return exponential[:3, :3], exponential[:3, 3:]


def two_mass_data(n: int, noise: float = 0.0, seed: int = 0) -> Data:
    u = LOAD_NM + prbs_nm(n, 60.0, seed=seed + 1)
    A, B = two_mass_discrete()
    x, speed = np.array([100.0, 100.0, LOAD_NM / TWO_MASS.k]), np.empty(n)
    for t in range(n):
        speed[t] = x[0]
        x = A @ x + B @ np.array([u[t], LOAD_NM])
    return u, speed + noise * np.random.default_rng(seed).normal(size=n), np.ones(n, dtype=bool)


def two_mass_theta() -> FloatArray:
    A, B = two_mass_discrete()
    numerator, denominator = ss2tf(A, B[:, :1], np.array([[1.0, 0.0, 0.0]]), np.zeros((1, 1)))
    return np.concatenate([denominator[1:], numerator[0, 1:]])


def two_mass_setup(adaptation: Adaptation) -> Setup:
    return Setup(sample_time_s=PERIOD_S, adaptation=adaptation, two_mass=TwoMass(1.2, 60.0, 3000.0, 14.0))


CASES = {
    name: Case(name, two_mass_theta(), two_mass_data, two_mass_setup)
    if name == "ekf"
    else Case(name, LINEAR.theta, linear_data, linear_setup)
    for name in ESTIMATORS
}
