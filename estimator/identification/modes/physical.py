"""The two-mass drive behind a linear model: inertias, stiffness, damping, friction, and which the data determine.

Torque at the motor in, motor speed out, is of third order with six coefficients, and the drive has six parameters::

    w_M     1          J_L s^2 + (c + b_L) s + k
    --- =  ---  ----------------------------------------------------------------------------------------------------
    T_M     1   J_M J_L s^3 + (J_M (c+b_L) + J_L (c+b_M)) s^2 + ((J_M+J_L) k + c (b_M+b_L) + b_M b_L) s + k (b_M+b_L)

They are estimated from the linear model in place of the data (indirect prediction-error method: T. Soderstrom, P.
Stoica and B. Friedlander, Automatica 27, 1991): with theta(x) the coefficients of the drive x, sampled with held
input, and P the covariance of the estimate theta_hat::

    minimise  (theta(x) - theta_hat)^T P^-1 (theta(x) - theta_hat)  +  sum of ((x_i - known_i) / std_i)^2

which for many samples is as good as fitting x to the data themselves. The second sum holds what is known beforehand.

Near constant speed friction is distinguished from the load torque by the lowest frequencies alone, and a motor friction
b_M damps the resonance almost as c does. Then b_M, b_L and c come out with intervals that hold 0, and the statement
says so; the sum c + b_M is sharp all the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares

from estimator.errors import BadModel, BadSetting
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.modes.reduced import THIRD, numerator_of, to_continuous
from estimator.identification.modes.uncertainty import Uncertain
from estimator.signals.record import FloatArray

UNITS = MappingProxyType(
    {"J_M": "kg m^2", "J_L": "kg m^2", "k": "Nm/rad", "c": "Nm s/rad", "b_M": "Nm s/rad", "b_L": "Nm s/rad"}
)
"""Names of the parameters, in the order of every array here, with their units."""

NAMES = tuple(UNITS)

RESPONDING = Orders(THIRD, THIRD, 1)
"""Structure of a sampled two-mass drive: one sample of delay."""

MOST_EVALUATIONS = 500
"""Of six parameters by differences; it needs some fifty."""

CURES = MappingProxyType(
    {
        "J_M": "raise the PRBS amplitude",
        "J_L": "record longer, with a PRBS that reaches below the anti-resonance",
        "k": "record longer, with a PRBS that reaches below the anti-resonance",
        "c": "give the motor's friction b_M as known, or measure it by coasting down",
        "b_M": "drive at several speeds or coast down, or give it as known",
        "b_L": "drive at several speeds or coast down, or give it as known",
    }
)


@dataclass(frozen=True, slots=True)
class PhysicalParameter:
    """One parameter with its unit and uncertainty.

    Attributes
    ----------
    name, unit : str
    estimate : Uncertain
        Value, standard deviation and 95 % interval.
    statement : str
        What the data say of it, and what would tell where they don't.
    """

    name: str
    unit: str
    estimate: Uncertain
    statement: str

    @property
    def is_determined(self) -> bool:
        """Tell whether the 95 % interval leaves out 0."""
        return self.estimate.is_determined


@dataclass(frozen=True, slots=True, eq=False)
class PhysicalEstimate:
    """The two-mass drive that a linear model is the response of.

    Attributes
    ----------
    parameters : Mapping[str, PhysicalParameter]
        ``J_M, J_L, k, c, b_M, b_L``.
    sums : Mapping[str, PhysicalParameter]
        ``J_M + J_L``, ``c + b_M``, ``b_M + b_L``: often determined where the single ones are not.
    covariance : ndarray, shape (6, 6)
        Of the parameters.
    misfit : float
        The minimum: chi-square of the coefficients against the drive's and of what was known; 0 without the latter.
    """

    parameters: Mapping[str, PhysicalParameter]
    sums: Mapping[str, PhysicalParameter]
    covariance: FloatArray
    misfit: float

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters the data leave open."""
        return tuple(name for name, parameter in self.parameters.items() if not parameter.is_determined)


SUMS = MappingProxyType({"J_M + J_L": (0, 1), "c + b_M": (3, 4), "b_M + b_L": (4, 5)})


def two_mass_model(parameters: FloatArray, sample_time_s: float) -> LinearModel:
    """Return the sampled response of motor speed to held motor torque of ``[J_M, J_L, k, c, b_M, b_L]``."""
    J_M, J_L, k, c, b_M, b_L = parameters
    block = np.zeros((4, 4))
    block[:3] = [
        [-(c + b_M) / J_M, c / J_M, -k / J_M, 1.0 / J_M],
        [c / J_L, -(c + b_L) / J_L, k / J_L, 0.0],
        [1.0, -1.0, 0.0, 0.0],
    ]
    sampled = expm(block * sample_time_s)
    A, B = sampled[:3, :3], sampled[:3, 3:]
    b = numerator_of(A, B, np.array([[1.0, 0.0, 0.0]]), 0.0)[1:]
    return LinearModel(tuple(np.real(np.poly(A))[1:].tolist()), tuple(b.tolist()), 1, sample_time_s)


def two_mass_start(model: LinearModel) -> FloatArray:
    """Return the parameters of a third-order model with friction left out, in closed form, shape (6,)."""
    response = to_continuous(model)
    beta_2, beta_1, beta_0 = response.numerator[1:]
    _, alpha_2, alpha_1, _ = response.denominator
    J_M, load_hz_squared = 1.0 / beta_2, beta_0 / beta_2  # the latter is k / J_L
    J_L = J_M * (alpha_1 / load_hz_squared - 1.0)
    c = max(J_M * (alpha_2 - beta_1 / beta_2), 0.0)
    start = np.array([J_M, J_L, load_hz_squared * J_L, c, 0.0, 0.0])
    if not (start[:3] > 0.0).all():
        raise BadModel(
            f"linear model: J_M, J_L, k would be {start[0]:.4g}, {start[1]:.4g}, {start[2]:.4g}, expected all above 0: "
            "no two-mass drive responds like this. Fit three coefficients each at the recording's own period, with "
            "fit_box_jenkins; check the sign and scale of torque and speed."
        )
    return start


def physical_parameters(
    model: LinearModel, covariance: FloatArray, known: Mapping[str, Uncertain] | None = None
) -> PhysicalEstimate:
    """Estimate the two-mass drive behind a linear model from motor torque to motor speed."""
    prior = _checked(model, covariance, known or {})
    start = two_mass_start(model)
    variances, axes = np.linalg.eigh(covariance)
    floor = float(variances[-1]) * np.finfo(np.float64).eps
    whitening = (axes / np.sqrt(np.maximum(variances, floor))).T
    scale = np.maximum(np.abs(start), start[3] if start[3] > 0.0 else 1.0)

    def residual(x: FloatArray) -> FloatArray:
        apart = two_mass_model(x * scale, model.sample_time_s).theta - model.theta
        pulled_to_prior = [(x[i] * scale[i] - known_i.value) / known_i.std for i, known_i in prior.items()]
        return np.concatenate([whitening @ apart, pulled_to_prior])

    solution = least_squares(residual, start / scale, jac="3-point", method="lm", max_nfev=MOST_EVALUATIONS)
    x, jacobian = solution.x * scale, np.asarray(solution.jac, dtype=np.float64)
    if not (x[:3] > 0.0).all():
        raise BadModel(f"linear model: J_M, J_L, k came out as {x[:3].tolist()}, expected all above 0. Record longer.")
    spread = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True) * np.outer(scale, scale)
    return _plausible(_estimate(x, spread, 2.0 * float(solution.cost)))


def _plausible(estimate: PhysicalEstimate) -> PhysicalEstimate:
    """Return an estimate no part of which is surely negative."""
    both = {**estimate.parameters, **estimate.sums}
    negative = [name for name, one in both.items() if one.estimate.ci95[1] < 0.0]
    if negative:
        intervals = "; ".join(
            f"{name} {both[name].estimate.ci95[0]:.4g} to {both[name].estimate.ci95[1]:.4g}" for name in negative
        )
        raise BadModel(
            f"linear model: {intervals} with 95 % confidence, expected values of 0 or more: this is not a two-mass "
            "line. A delay or lag between torque and speed, a third mass or a gap look like this; see the residual "
            "tests, or diagnose the recording."
        )
    return estimate


def _checked(model: LinearModel, covariance: FloatArray, known: Mapping[str, Uncertain]) -> dict[int, Uncertain]:
    if model.orders != RESPONDING or covariance.shape != (2 * THIRD, 2 * THIRD):
        raise BadModel(
            f"linear model: {model.orders} with a covariance of shape {covariance.shape}, expected {RESPONDING} and "
            "(6, 6): the structure of a two-mass drive. Fit that, or take the third-order equivalent."
        )
    for name, value in known.items():
        if name not in UNITS or not value.std > 0.0:
            raise BadSetting(
                f"known parameter {name} with standard deviation {value.std}: expected one of {', '.join(NAMES)}, with "
                "a standard deviation above 0."
            )
    return {NAMES.index(name): value for name, value in known.items()}


def _estimate(x: FloatArray, covariance: FloatArray, misfit: float) -> PhysicalEstimate:
    parameters = {
        name: _parameter(name, UNITS[name], _uncertain(name, float(x[i]), float(covariance[i, i])), CURES[name])
        for i, name in enumerate(NAMES)
    }
    sums = {}
    for name, (i, j) in SUMS.items():
        variance = covariance[i, i] + covariance[j, j] + 2.0 * covariance[i, j]
        total = _uncertain(name, float(x[i] + x[j]), float(variance))
        sums[name] = _parameter(name, UNITS[NAMES[i]], total, CURES[NAMES[j]])
    return PhysicalEstimate(MappingProxyType(parameters), MappingProxyType(sums), covariance, misfit)


def _uncertain(name: str, value: float, variance: float) -> Uncertain:
    """Return a parameter with its deviation; the response's coefficients hold inertias by their reciprocals."""
    return Uncertain(value, float(np.sqrt(max(variance, 0.0))), is_reciprocal=name.startswith("J"))


def _parameter(name: str, unit: str, estimate: Uncertain, cure: str) -> PhysicalParameter:
    low, high = estimate.ci95
    interval = f"{low:.4g} to {high:.4g} {unit}"
    if estimate.is_determined:
        statement = f"{name} is {estimate.value:.4g} {unit}, with 95 % confidence {interval}."
    else:
        statement = f"The data do not determine {name}: its 95 % interval, {interval}, holds 0. To tell: {cure}."
    return PhysicalParameter(name, unit, estimate, statement)
