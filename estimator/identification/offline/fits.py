"""The off-line fits, output error and Box-Jenkins, the noise model that both need, and the free run of what they find.

The noise is an autoregression ``D(q^-1) e(t) = w(t)``, w white. An output-error model explains y by u alone. What it
leaves is coloured: the load's slow changes, shaped by the drive. Burg's method (J. P. Burg, 1967; S. M. Kay, Modern
Spectral Estimation, chapter 7) finds D one reflection coefficient at a time from the forward error f and the backward
error g::

    k_m = - 2 sum f_(m-1)(t) g_(m-1)(t-1) / sum (f_(m-1)(t)^2 + g_(m-1)(t-1)^2)

Output error: the prediction-error method on the free-run simulation (:mod:`problem` has the equations); consistent
whatever the colour of the noise on y as long as torque does not follow speed; its covariance takes the colour into
account. Box-Jenkins: ``y = B / A u + 1 / D w``, w white. The sum of w^2 over A, B and D together is least at the
maximum-likelihood estimate (Box and Jenkins, Time Series Analysis, chapter 11; Ljung, System Identification, 2nd ed.,
section 7.4). D is long, a second: road, grade and the driver's slow changes are the noise's, and no pole of the
driveline has to follow them. The covariance is that of the joint estimate, so that what feedback correlates, plant and
noise, widens the intervals. What that gains on 200 buses on a road is in docs/benchmarks.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from scipy.signal import lfilter

from estimator.errors import BadModel, BadSetting
from estimator.identification.linear_model import ComplexArray, LinearModel, Orders
from estimator.identification.offline.problem import Problem, simulated
from estimator.identification.offline.starts import candidates, subspace
from estimator.identification.settings import require_excitation
from estimator.signals.decimate import Blocks, block_of
from estimator.signals.record import BoolArray, FloatArray, Record

MEMORY_S = 1.0
"""Reach of the autoregression [s]: a driver answers the speed after 0.3 to 1 s, and what a noise model does not reach
is left to the response. On 200 buses in closed loop (``python -m tests.benchmarks.identification``) intervals of J_M
and k hold 97 and 96 % of the truths; on forty of them, reaching half as far, 90 and 85 %."""

SAMPLES_PER_COEFFICIENT = 10
"""Terms of the sums asked for per coefficient; where masks leave fewer, the order ends there."""

PERIOD_TOLERANCE = 0.02
"""Relative. Jitter averages out over a recording; a wrong period is off by far more."""


@dataclass(frozen=True, slots=True, eq=False)
class NoiseModel:
    """The autoregression of a residual."""

    D: FloatArray  # (p+1,): coefficients in q^-1, leading 1; ``[1]`` for white noise
    std: float  # standard deviation of w [output unit]

    @property
    def order(self) -> int:
        """Number of past residuals that tell of the next."""
        return int(self.D.shape[0]) - 1

    def whiten(self, x: FloatArray) -> FloatArray:
        """Return D x; the first p values lack a past."""
        return np.asarray(lfilter(self.D, [1.0], x, axis=0), dtype=np.float64)

    def complete(self, okay: BoolArray) -> BoolArray:
        """Tell which samples and all p before them are good, shape (N,)."""
        counts = np.concatenate([[0], np.cumsum(okay)])
        good: BoolArray = np.zeros(okay.shape, dtype=np.bool_)
        reach = self.order + 1
        good[reach - 1 :] = counts[reach:] - counts[:-reach] == reach
        return good

    def coloured_backwards(self, psi: FloatArray) -> FloatArray:
        """Return ``sum_i h_i psi(t+i)`` along the first axis, with h the impulse response of 1 / D."""
        return np.asarray(lfilter([1.0], self.D, psi[::-1], axis=0)[::-1], dtype=np.float64)

    def spectrum(self, frequency_hz: FloatArray, sample_time_s: float) -> FloatArray:
        """Return the spectral density of e, one-sided [output unit squared per Hz]."""
        q = np.exp(-2j * np.pi * frequency_hz * sample_time_s)
        density = 2.0 * self.std**2 * sample_time_s / np.abs(np.polynomial.polynomial.polyval(q, self.D)) ** 2
        return np.asarray(density, dtype=np.float64)


def white(e: FloatArray, okay: BoolArray) -> NoiseModel:
    """Return the model of a residual without memory."""
    return NoiseModel(np.ones(1), float(np.sqrt(np.mean(e[okay] ** 2))) if okay.any() else 0.0)


def reach(sample_time_s: float) -> int:
    """Return the order that spans the memory asked for at a sampling period [s]."""
    return max(round(MEMORY_S / sample_time_s), 1)


def fit_noise(e: FloatArray, okay: BoolArray, order: int) -> NoiseModel:
    """Fit the autoregression of a residual by Burg's method."""
    forward = np.where(okay, e, 0.0)
    backward, valid = forward.copy(), okay.copy()
    D, power = np.ones(1), float(np.mean(forward[okay] ** 2)) if okay.any() else 0.0
    for m in range(1, order + 1):
        valid = valid[1:] & okay[: okay.shape[0] - m]
        ahead, behind = forward[1:], backward[:-1]
        f, g = ahead[valid], behind[valid]
        energy = float(f @ f + g @ g)
        if f.shape[0] < SAMPLES_PER_COEFFICIENT * m or energy <= 0.0:
            break
        k = -2.0 * float(f @ g) / energy
        forward, backward = ahead + k * behind, behind + k * ahead
        D = np.concatenate([D, [0.0]]) + k * np.concatenate([[0.0], D[::-1]])
        power *= 1.0 - k * k
    return NoiseModel(D, float(np.sqrt(power)))


def sandwich(gradient: FloatArray, okay: BoolArray, noise: NoiseModel) -> FloatArray:
    """Return the covariance of all parameters of a least-squares fit, shape (n, n)."""
    psi = np.where(okay[:, np.newaxis], gradient, 0.0)
    n_samples = int(np.count_nonzero(okay))
    spent = psi.shape[1] + noise.order
    bread = np.linalg.pinv(psi.T @ psi, hermitian=True)
    psi_h = noise.coloured_backwards(psi)
    scale = noise.std**2 * n_samples / max(n_samples - spent, 1)
    return np.asarray(scale * bread @ (psi_h.T @ psi_h) @ bread, dtype=np.float64)


def require_identifiable(record: Record, orders: Orders) -> None:
    """Refuse a recording that can't determine a model of these orders: wrong period, too short, no excitation."""
    stamped_s = float(np.median(np.diff(record.time_s))) if record.time_s.shape[0] > 1 else record.sample_time_s
    if abs(stamped_s - record.sample_time_s) > PERIOD_TOLERANCE * record.sample_time_s:
        raise BadSetting(
            f"recording {record.name}: sample_time_s is {record.sample_time_s:g}, its time stamps are {stamped_s:g} s "
            f"apart; expected one period. Frequencies would be wrong by {stamped_s / record.sample_time_s:.3g}; the "
            "resonance and the stiffness can't be determined. Correct the period or the time column's scale."
        )
    require_excitation(record.name, record.total_torque_nm, record.output, record.okay, orders)


class Method(Enum):
    """Off-line estimators; the value is the name in reports."""

    OUTPUT_ERROR = "output_error"
    BOX_JENKINS = "box_jenkins"


@dataclass(frozen=True, slots=True, eq=False)
class LinearFit:
    """A fitted model and how well it does."""

    method: Method  # which estimator
    model: LinearModel  # transfer function
    covariance: FloatArray  # covariance of theta, the residual's colour taken into account
    state: FloatArray  # (n_states + 1,): ``[c, h]``
    first: int  # first good sample
    rms: float  # RMS of the free-run simulation error [output unit]
    fit_percent: float  # 100 (1 - NRMSE) of the free run [%]
    one_step_fit_percent: float  # the same for the prediction one step ahead
    noise: NoiseModel  # of the free-run residual
    n_samples: int  # good samples used
    block: int = 1  # samples whose mean residual is one sample to the noise model

    def simulate(self, u: FloatArray) -> FloatArray:
        """Free-run simulation over the data's inputs, shape (N,); the time before ``first`` is 0."""
        out = np.zeros(u.shape[0])
        out[self.first :] = simulated(self.model, u[self.first :], self.state)
        return out


def fit_percent(error: FloatArray, measured: FloatArray) -> float:
    """Return the normalised RMS fit [%] of errors, shape (n,), against the outputs they belong to."""
    spread = float(np.linalg.norm(measured - measured.mean()))
    return 100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread > 0.0 else float("nan")


def one_step_fit(error: FloatArray, y: FloatArray, okay: BoolArray, noise: NoiseModel, block: int) -> float:
    """Return the fit [%] of the prediction one step of the noise model ahead; NaN where no past is complete."""
    blocks = Blocks(okay, block)
    complete = noise.complete(blocks.okay)
    if not complete.any():
        return float("nan")
    return fit_percent(noise.whiten(blocks.mean(error))[complete], blocks.mean(y)[complete])


def summary(
    method: Method,
    model: LinearModel,
    covariance: FloatArray,
    state: FloatArray,
    first: int,
    y: FloatArray,
    okay: BoolArray,
    error: FloatArray,
    noise: NoiseModel,
    block: int,
) -> LinearFit:
    """Put a result together; y, okay and the free-run error of shape (N - first,)."""
    return LinearFit(
        method=method,
        model=model,
        covariance=covariance,
        state=state,
        first=first,
        rms=float(np.sqrt(np.mean(error[okay] ** 2))),
        fit_percent=fit_percent(error[okay], y[okay]),
        one_step_fit_percent=one_step_fit(error, y, okay, noise, block),
        noise=noise,
        n_samples=int(np.count_nonzero(okay)),
        block=block,
    )


def problem_of(record: Record, orders: Orders | None) -> tuple[Problem, int]:
    """Return the output-error problem of a recording from its first good sample on, and the number of that sample."""
    orders = Orders() if orders is None else orders
    require_identifiable(record, orders)
    first = int(record.okay.argmax())
    problem = Problem(
        u=record.total_torque_nm[first:],
        y=record.output[first:],
        okay=record.okay[first:],
        orders=orders,
        sample_time_s=record.sample_time_s,
        read=None if record.read is None else record.read[first:],
        block=block_of(record.sample_time_s),
    )
    return problem, first


def starts(problem: Problem) -> Iterator[FloatArray]:
    """Yield an x for each start; always at least one."""
    k, orders = problem.block, problem.orders
    period_s = k * problem.sample_time_s
    u, y, okay = problem.blocks.mean(problem.u), problem.blocks.mean(problem.y), problem.blocks.okay
    if k > 1:
        everywhere = replace(problem, okay=np.ones_like(problem.okay))
        u = everywhere.blocks.mean(problem.u)
    first = subspace(u, y, okay, orders, period_s)
    models = [] if first is None else [first]
    for model in (*models, *candidates(u, y, okay, orders, period_s)):
        yield problem.start(model) if k == 1 else problem.start_at(_faster(model.poles, k))


def _faster(poles: ComplexArray, k: int) -> ComplexArray:
    """Return poles at a period k times as short; a negative one, which has no such root, keeps its radius."""
    real = np.where(poles.imag == 0.0, np.abs(poles.real), poles)
    return np.asarray(real ** (1.0 / k), dtype=np.complex128)


def summarised(
    method: Method, problem: Problem, x: FloatArray, first: int, covariance: FloatArray, noise: NoiseModel
) -> LinearFit:
    """Put together what came out at x; ``covariance`` of theta, shape (na+nb, na+nb)."""
    return summary(
        method,
        problem.model(x),
        covariance,
        problem.state(x),
        first,
        problem.y,
        problem.okay,
        problem.error(x),
        noise,
        problem.block,
    )


def fit_output_error(record: Record, orders: Orders | None = None) -> LinearFit:
    """Fit B / A by the least error of its free run (output error), with standard deviations for coloured noise."""
    problem, first = problem_of(record, orders)
    x = problem.solve(starts(problem))
    noise = fit_noise(problem.blocks.mean(problem.error(x)), problem.blocks.okay, reach(problem.period_s))
    gradient = problem.blocks.mean(problem.gradient(x))
    covariance = sandwich(gradient, problem.blocks.okay, noise)
    n = problem.orders.n_parameters
    return summarised(Method.OUTPUT_ERROR, problem, x, first, covariance[:n, :n], noise)


def fit_box_jenkins(record: Record, orders: Orders | None = None, memory: int | None = None) -> LinearFit:
    """Fit a Box-Jenkins model to a recording's total torque and output."""
    return fit_of(*solved(record, orders, memory))


def fit_of(problem: Problem, x: FloatArray, first: int) -> LinearFit:
    """Return the fit at the minimum of :func:`solved`, with the covariance of the joint estimate."""
    covariance, noise = _spread(problem, x)
    free = problem.with_free_response(x)  # a free run is judged by itself
    return summarised(Method.BOX_JENKINS, problem, free, first, covariance, noise)


def solved(record: Record, orders: Orders | None, memory: int | None = None) -> tuple[Problem, FloatArray, int]:
    """Return the joint problem, its minimum, and the first sample it counts from; as :func:`fit_box_jenkins`."""
    plain, first = problem_of(record, orders)
    order = reach(plain.period_s) if memory is None else memory
    begin = [(x, _noise_of(plain, x, order)) for x in starts(plain)]
    problem = replace(plain, noise_order=min(noise.order for _, noise in begin))
    x = problem.solve([np.concatenate([x, noise.D[1 : problem.noise_order + 1]]) for x, noise in begin])
    return problem, x, first


def _noise_of(problem: Problem, x: FloatArray, order: int) -> NoiseModel:
    return fit_noise(problem.blocks.mean(problem.error(x)), problem.blocks.okay, order)


def _spread(problem: Problem, x: FloatArray) -> tuple[FloatArray, NoiseModel]:
    """Return the covariance of theta, ``sigma^2 (J^T J)^-1`` of the joint estimate, and the noise model."""
    n, w = problem.orders.n_parameters, problem.residual(x)
    J = problem.jacobian(x, of_theta=True)
    scale = np.maximum(np.linalg.norm(J, axis=0), np.finfo(np.float64).tiny)
    inverse = np.linalg.pinv((J / scale).T @ (J / scale), hermitian=True) / np.outer(scale, scale)
    variance = float(w @ w) / max(w.shape[0] - problem.n_unknowns(x) - J.shape[1], 1)
    D = np.concatenate([[1.0], x[problem.n_plant :]])
    return variance * inverse[:n, :n], NoiseModel(D, float(np.sqrt(variance)))


@dataclass(frozen=True, slots=True, eq=False)
class FreeRun:
    """Free-run simulation next to the measurement."""

    name: str  # the recording
    error: FloatArray  # (N,): measured less simulated output [output unit]; NaN where there is none
    rms: float  # of the good samples [output unit]
    fit_percent: float  # in free run, and one step ahead with the noise model given
    one_step_fit_percent: float  # the same of the one-step prediction [%]


def free_run(model: LinearModel, record: Record, noise: NoiseModel) -> FreeRun:
    """Simulate a model over a recording from the best start; BadModel for another period or an unstable model."""
    period_s = record.sample_time_s
    if not np.isclose(period_s, model.sample_time_s, rtol=1e-3) or not model.is_stable:
        raise BadModel(
            f"recording {record.name}: sampled every {period_s:g} s, the model every {model.sample_time_s:g} s with "
            f"poles of radius up to {np.abs(model.poles).max(initial=0.0):.4g}, expected one period and radii below 1. "
            "Prepare both recordings alike; take a stable estimate."
        )
    first = int(record.okay.argmax())
    u, y, okay = record.total_torque_nm[first:], record.output[first:], record.okay[first:]
    problem = Problem(u, y, okay, model.orders, model.sample_time_s)
    error = np.where(okay, problem.error(problem.start(model)), np.nan)
    return FreeRun(
        name=record.name,
        error=np.concatenate([np.full(first, np.nan), error]),
        rms=float(np.sqrt(np.mean(error[okay] ** 2))),
        fit_percent=fit_percent(error[okay], y[okay]),
        one_step_fit_percent=one_step_fit(error, y, okay, noise, block_of(period_s)),
    )
