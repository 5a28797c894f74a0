"""The two-mass drive behind a linear model: inertias, stiffness, damping, friction, and which the data determine.

Torque at the motor in, motor speed out, is of third order with six coefficients, and the drive has six parameters::

    w_M     1          J_L s^2 + (c + b_L) s + k
    --- =  ---  ----------------------------------------------------------------------------------------------------
    T_M     1   J_M J_L s^3 + (J_M (c+b_L) + J_L (c+b_M)) s^2 + ((J_M+J_L) k + c (b_M+b_L) + b_M b_L) s + k (b_M+b_L)

They are estimated from the linear model in place of the data (indirect prediction-error method: T. Soderstrom, P.
Stoica and B. Friedlander, Automatica 27, 1991): with theta(x) the coefficients of the drive x, sampled with held
input, and P the covariance of the estimate theta_hat, minimise the deviance::

    D(x) = (theta(x) - theta_hat)^T P^-1 (theta(x) - theta_hat)  +  sum of ((x_i - known_i) / std_i)^2

over what a line can be: inertias and stiffness above 0, damping and frictions 0 or more (it is then passive). The
second sum holds what is known beforehand. Intervals are profile likelihood (Meeker and Escobar, The American
Statistician 49, 1995): the values v of a parameter for which the least D with x_i = v is within the chi-square quantile
of the minimum.
They end at 0 where the data allow it, and reach as far up as the data do: no normal distribution is supposed.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from estimator.errors import BadModel, BadSetting
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.modes.modes import QUANTILE, Uncertain, resonance
from estimator.identification.modes.reduced import THIRD, to_continuous
from estimator.signals.record import FloatArray

UNITS = MappingProxyType(
    {"J_M": "kg m^2", "J_L": "kg m^2", "k": "Nm/rad", "c": "Nm s/rad", "b_M": "Nm s/rad", "b_L": "Nm s/rad"}
)
"""Names of the parameters, in the order of every array here, with their units."""

NAMES = tuple(UNITS)

SUMS = MappingProxyType({"J_M + J_L": (0, 1), "c + b_M": (3, 4), "b_M + b_L": (4, 5)})
"""Often determined where the single ones are not."""

POSITIVE = 3  # the first parameters are above 0 and estimated by their logarithms; the others may be 0
RESPONDING = Orders(THIRD, THIRD, 1)  # structure of a sampled two-mass drive: one sample of delay

IMPLAUSIBLE = float(chi2.isf(1e-3, 2 * THIRD))
"""Deviance from which on no line that can be responds like this: one in 1000, all six coefficients free."""

MOST_ROUNDS, SETTLED = 60, 1e-7
"""Gauss-Newton rounds of a minimum, and the relative fall of the deviance that ends them."""

WIDEST = math.log(1e3)
"""How far from the estimate an end of an interval is looked for; beyond it is 0 or infinity."""

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
    """One parameter with its unit and uncertainty."""

    name: str  # J_M, J_L, k, c, b_M, b_L, or a sum of two
    unit: str  # SI
    estimate: Uncertain  # value, standard deviation and 95 % interval
    statement: str  # what the data say of it, and what would tell where they don't

    @property
    def is_determined(self) -> bool:
        """Tell whether the 95 % interval is short against the value."""
        return self.estimate.is_determined


@dataclass(frozen=True, slots=True, eq=False)
class PhysicalEstimate:
    """The two-mass drive that a linear model is the response of."""

    parameters: Mapping[str, PhysicalParameter]  # ``J_M, J_L, k, c, b_M, b_L``
    sums: Mapping[str, PhysicalParameter]  # ``J_M + J_L``, ``c + b_M``, ``b_M + b_L``
    misfit: float  # the least deviance

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters the data leave open."""
        return tuple(name for name, parameter in self.parameters.items() if not parameter.is_determined)


def coefficients_of(parameters: FloatArray, sample_time_s: float) -> FloatArray:
    """Return theta of drives ``[J_M, J_L, k, c, b_M, b_L]``, shape (m, 6) both: sampled with held torque.

    The exponential of the motion by its series, scaled and squared; characteristic polynomial and numerator by traces
    and Markov parameters.
    """
    J_M, J_L, k, c, b_M, b_L = parameters.T
    block = np.zeros((parameters.shape[0], 4, 4))
    block[:, 0, 0], block[:, 0, 1], block[:, 0, 2], block[:, 0, 3] = -(c + b_M) / J_M, c / J_M, -k / J_M, 1.0 / J_M
    block[:, 1, 0], block[:, 1, 1], block[:, 1, 2] = c / J_L, -(c + b_L) / J_L, k / J_L
    block[:, 2, 0], block[:, 2, 1] = 1.0, -1.0
    motion = block * sample_time_s
    doublings = max(0, math.ceil(math.log2(max(float(np.abs(motion).sum(axis=2).max()), 1e-300))) + 1)
    motion = motion / 2.0**doublings
    term = sampled = np.broadcast_to(np.eye(4), motion.shape)
    for order in range(1, 15):  # 2^-14 / 14! is below the rounding
        term = term @ motion / order
        sampled = sampled + term
    for _ in range(doublings):
        sampled = sampled @ sampled
    A, h = sampled[:, :3, :3], sampled[:, :3, 3:]
    trace = np.trace(A, axis1=1, axis2=2)
    square = np.trace(A @ A, axis1=1, axis2=2)
    a = np.stack([-trace, 0.5 * (trace**2 - square), -np.linalg.det(A)], axis=1)
    h_1, h_2, h_3 = h[:, 0, 0], (A @ h)[:, 0, 0], (A @ A @ h)[:, 0, 0]
    b = np.stack([h_1, h_2 + a[:, 0] * h_1, h_3 + a[:, 0] * h_2 + a[:, 1] * h_1], axis=1)
    return np.concatenate([a, b], axis=1)


def two_mass_model(parameters: FloatArray, sample_time_s: float) -> LinearModel:
    """Return the sampled response of motor speed to held motor torque of ``[J_M, J_L, k, c, b_M, b_L]``."""
    return LinearModel.from_theta(
        coefficients_of(np.asarray(parameters)[np.newaxis], sample_time_s)[0], RESPONDING, sample_time_s
    )


def two_mass_start(model: LinearModel) -> FloatArray:
    """Return the parameters of a third-order model with friction left out, shape (6,): in closed form where it has one.

    Raises BadModel if the speed answers the torque the wrong way round.
    """
    first = model.b[0] / model.sample_time_s  # held torque moves the motor alone at first: 1 / J_M
    if not first > 0.0:
        raise BadModel(
            f"linear model: b_1 is {model.b[0]:.4g}, expected above 0, since a torque speeds its motor up. "
            "Please check the sign and scale of torque and speed."
        )
    try:
        response = to_continuous(model)
    except BadModel:  # a pole that no continuous system has: the data do not say how fast it is
        found = resonance(model, (0.0, math.inf))
        rate = 2.0 * math.pi * (found.frequency_hz if found else 0.1 / model.sample_time_s)
        return np.array([1.0 / first, 30.0 / first, rate**2 / first, 0.1 * rate / first, 0.0, 0.0])
    beta_2, beta_1, beta_0 = response.numerator[1:]
    _, alpha_2, alpha_1, _ = response.denominator
    J_M = 1.0 / beta_2 if beta_2 > 0.0 else 1.0 / first
    of_load = beta_0 * J_M  # k / J_L
    if not (of_load > 0.0 and alpha_1 > of_load):
        rate_2 = max(alpha_1, (0.1 / model.sample_time_s) ** 2)
        return np.array([J_M, 30.0 * J_M, J_M * rate_2, 0.1 * J_M * math.sqrt(rate_2), 0.0, 0.0])
    J_L = J_M * (alpha_1 / of_load - 1.0)
    return np.array([J_M, J_L, of_load * J_L, max(J_M * (alpha_2 - beta_1 * J_M), 0.0), 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class _Likelihood:
    """The deviance over ``z = [ln J_M, ln J_L, ln k, c, b_M, b_L]``, the last three in units of the start's damping."""

    model: LinearModel  # the discrete model whose coefficients are to be met
    whitening: FloatArray  # square root of the inverse covariance of theta
    known: Mapping[int, Uncertain]  # parameters known beforehand, by their place
    unit: float  # of the last three entries of z [Nm s/rad]
    least: FloatArray  # (6,), smallest z
    most: FloatArray  # (6,), largest z

    def parameters(self, z: FloatArray) -> FloatArray:
        """Return J_M, J_L, k, c, b_M, b_L in SI of z, shape (..., 6)."""
        return np.concatenate([np.exp(z[..., :POSITIVE]), self.unit * z[..., POSITIVE:]], axis=-1)

    def residual(self, z: FloatArray) -> FloatArray:
        """Return the whitened differences of coefficients and known values, shape (Z, n + known), of z (Z, 6)."""
        x = self.parameters(z)
        off = (coefficients_of(x, self.model.sample_time_s) - self.model.theta) @ self.whitening.T
        prior = [(x[:, i] - one.value) / one.std for i, one in self.known.items()]
        return np.column_stack([off, *prior])

    def linearised(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the differences at z and their derivatives by central differences."""
        step = 1e-5 * np.diag(np.maximum(np.abs(z), 1.0))
        both = self.residual(np.vstack([z, z + step, z - step]))
        return both[0], ((both[1:7] - both[7:]) / (2.0 * np.diag(step)[:, np.newaxis])).T

    def minimum(self, z: FloatArray, held: _Held | None = None) -> tuple[FloatArray, float]:
        """Return where the deviance is least, from z on, and that deviance; with a quantity held where one is given."""
        damping, z = 1e-3, np.clip(z, self.least, self.most)
        best = self._cost(z, held)
        for _ in range(MOST_ROUNDS):
            r, J = self.linearised(z)
            if held is not None:
                r, J = np.append(r, held.off(self.parameters(z))), np.vstack([J, held.slope(self, z)])
            while damping < 1e12:
                after = np.clip(z + self._step(r, J, damping, z), self.least, self.most)
                cost = self._cost(after, held)
                if cost <= best:
                    break
                damping *= 10.0
            else:
                break
            fallen, z, best, damping = best - cost, after, cost, max(damping / 10.0, 1e-12)
            if fallen <= SETTLED * (best + 1.0):
                break
        return z, float(np.sum(self.residual(z[np.newaxis]) ** 2))

    def _cost(self, z: FloatArray, held: _Held | None) -> float:
        with np.errstate(over="ignore", invalid="ignore"):
            cost = float(np.sum(self.residual(z[np.newaxis]) ** 2))
        cost += 0.0 if held is None else held.off(self.parameters(z)) ** 2
        return cost if math.isfinite(cost) else math.inf

    def _step(self, r: FloatArray, J: FloatArray, damping: float, z: FloatArray) -> FloatArray:
        """Return the damped Gauss-Newton step that keeps what may be 0 at 0 or more."""
        size = np.maximum(np.linalg.norm(J, axis=0), 1e-9 * max(float(np.abs(J).max()), 1e-300))
        rows = np.vstack([J / size, math.sqrt(damping) * np.eye(6)])
        wanted = np.concatenate([-r, np.zeros(6)])
        step = np.linalg.lstsq(rows, wanted, rcond=None)[0]
        after = z + step / size
        if (after < self.least).any() or (after > self.most).any():
            room = (self.least - z) * size - 1e-12, (self.most - z) * size + 1e-12
            step = lsq_linear(rows, wanted, room, method="bvls").x
        widest = 2.0 * np.maximum(np.abs(z), 1.0)
        return np.asarray(np.clip(step / size, -widest, widest), dtype=np.float64)


@dataclass(frozen=True)
class _Held:
    """A parameter, or the sum of two, kept at a value by a spring far stiffer than the data."""

    places: tuple[int, ...]  # of the parameters whose sum is held
    value: float  # that it is held at
    width: float  # deviation that counts as one standard deviation

    def off(self, x: FloatArray) -> float:
        """Return how far the sum is from the value, in standard deviations."""
        return float((x[list(self.places)].sum() - self.value) / self.width)

    def slope(self, of: _Likelihood, z: FloatArray) -> FloatArray:
        """Return its derivative by z, shape (6,)."""
        slope = np.zeros(6)
        x = of.parameters(z)
        for i in self.places:
            slope[i] = (x[i] if i < POSITIVE else of.unit) / self.width
        return slope


def physical_parameters(
    model: LinearModel,
    covariance: FloatArray,
    known: Mapping[str, Uncertain] | None = None,
    names: Collection[str] = (*NAMES, *SUMS),
) -> PhysicalEstimate:
    """Estimate the two-mass drive behind a linear model from motor torque to motor speed.

    Returned are the parameters and sums of these ``names``: an interval is some twenty constrained fits.
    """
    prior = _checked(model, covariance, known or {})
    start = two_mass_start(model)
    variances, axes = np.linalg.eigh(covariance)
    floor = float(variances[-1]) * np.finfo(np.float64).eps
    whitening = (axes / np.sqrt(np.maximum(variances, floor))).T
    unit = start[3] if start[3] > 0.0 else 0.1 * math.sqrt(start[0] * start[2])
    begin = np.concatenate([np.log(start[:POSITIVE]), start[POSITIVE:] / unit])
    far = 1.5 * WIDEST  # of logarithms: such a line is as good as rigid or free
    least, most = (begin[:POSITIVE] + side * far for side in (-1.0, 1.0))
    likelihood = _Likelihood(
        model, whitening, prior, float(unit), np.append(least, [0.0] * 3), np.append(most, [math.exp(far)] * 3)
    )
    both = begin, begin + np.array([0.0, 0.0, 0.0, 0.5, 0.1, 0.1])  # damping in the shaft alone, or in bearings, too
    z, misfit = min((likelihood.minimum(each) for each in both), key=lambda one: one[1])
    if misfit > IMPLAUSIBLE:
        raise BadModel(
            f"linear model: chi-square {misfit:.3g} away from the nearest line of two masses that can be, expected at "
            f"most {IMPLAUSIBLE:.3g}: this is not a two-mass line. A delay or lag between torque and speed, a third "
            "mass or a gap look like this; see the residual tests, check the sign and scale of torque and speed, or "
            "diagnose the recording."
        )
    return _estimate(likelihood, z, misfit, names)


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


def _estimate(likelihood: _Likelihood, z: FloatArray, misfit: float, names: Collection[str]) -> PhysicalEstimate:
    x, (_, J) = likelihood.parameters(z), likelihood.linearised(z)
    spread = np.linalg.pinv(J.T @ J, hermitian=True)

    def quantity(name: str, places: tuple[int, ...]) -> PhysicalParameter:
        slope = _Held(places, 0.0, 1.0).slope(likelihood, z)
        guess = math.sqrt(max(float(slope @ spread @ slope), 0.0))
        value = float(x[list(places)].sum())
        low, high = (_end(likelihood, z, misfit, places, guess, side) for side in (-1.0, 1.0))
        std = (high - low) / (2.0 * QUANTILE)
        return _parameter(name, UNITS[NAMES[places[0]]], Uncertain(value, std, (low, high)), CURES[NAMES[places[-1]]])

    parameters = {name: quantity(name, (i,)) for i, name in enumerate(NAMES) if name in names}
    sums = {name: quantity(name, places) for name, places in SUMS.items() if name in names}
    return PhysicalEstimate(MappingProxyType(parameters), MappingProxyType(sums), misfit)


def _end(
    likelihood: _Likelihood, z: FloatArray, misfit: float, places: tuple[int, ...], guess: float, side: float
) -> float:
    """Return the end of an interval to one side: where the square root of the deviance's rise is the quantile.

    That root is nearly straight over the quantity, or over its logarithm where it can't be 0.
    """
    value = float(likelihood.parameters(z)[list(places)].sum())
    by_log = places[0] < POSITIVE
    scale = value if by_log else max(value, 1e-2 * likelihood.unit)
    most = WIDEST if by_log else math.exp(WIDEST)

    def at(t: float) -> float:
        return value * math.exp(side * t) if by_log else max(value + side * t * scale, 0.0)

    def width(v: float) -> float:
        return min(1e-4 * max(v, 1e-2 * scale), 1e-2 * guess) if guess > 0.0 else 1e-4 * max(v, 1e-2 * scale)

    t, inside, outside = min(QUANTILE * guess / scale, 0.5), 0.0, math.inf
    for _ in range(20):
        t = min(max(t, 1e-12), most)
        v = at(t)
        there, deviance = likelihood.minimum(z, _Held(places, v, width(v)))
        root = math.sqrt(max(deviance - misfit, 0.0))
        if abs(root - QUANTILE) < 0.02 or (outside - inside) < 1e-3 * inside:
            break
        if root > QUANTILE:
            outside = t
        elif v == 0.0 or t == most:
            return math.inf if side > 0.0 else 0.0
        else:
            inside, z = t, there
        straight = t * QUANTILE / max(root, 0.3)
        t = straight if inside < straight < outside else 0.5 * (inside + min(outside, 7.0 * t))
    return at(t)


def _parameter(name: str, unit: str, estimate: Uncertain, cure: str) -> PhysicalParameter:
    low, high = estimate.ci95
    interval = f"{low:.4g} to {high:.4g} {unit}"
    if estimate.is_determined:
        statement = f"{name} is {estimate.value:.4g} {unit}, with 95 % confidence {interval}."
    elif low <= 0.0:
        statement = f"The data do not determine {name}: its 95 % interval, {interval}, holds 0. To tell: {cure}."
    else:
        statement = f"The data do not determine {name}: its 95 % interval, {interval}, is wide. To tell: {cure}."
    return PhysicalParameter(name, unit, estimate, statement)
