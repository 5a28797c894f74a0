"""One model of several recordings: the Box-Jenkins fits of all of them at once, with common A and B.

Each recording keeps the noise model and the free response of its own fit; poles and numerator are shared. With s_i the
standard deviation of recording i's innovations w_i, the maximum-likelihood estimate is the least of

    sum_i |w_i(A, B, C_i, D_i)|^2 / s_i^2

(L. Ljung, System Identification, 2nd ed., section 7.4, of independent experiments). The normal equations are an arrow:
what a recording has of its own is eliminated first, so that the work grows with their number and not with its square.

What sharing costs recording i, ``L_i = (|w_i|^2 shared - |w_i|^2 own) / s_i^2``, is the likelihood ratio: of recordings
of one drive the sum is chi-square with ``(R - 1) (na + nb)`` degrees of freedom. A recording that pays more than chance
makes it pay, and an amount that matters, does not agree with the others; it is left out and named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from estimator.errors import BadModel
from estimator.identification.best import BestEstimate, ModelVerdict, known_pair
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import UncertainMode
from estimator.identification.modes.physical import PhysicalEstimate, physical_parameters
from estimator.identification.offline.problem import SETTLED, Problem
from estimator.signals.record import FloatArray

MOST_STARTS = 3
"""Recordings whose own parameters are followed as a start, the best first: the valley has more than one floor."""

MOST_STEPS = 60
FIRST_DAMPING = 1e-3
"""Levenberg and Marquardt's, of the shared parameters scaled by their slopes."""

MOST_DAMPING = 1e6
"""From here on a step is too short to matter: there is none that is better."""

SIGNIFICANCE = 0.001
"""False alarms of the agreement, on recordings of one drive."""

SAME_SAMPLES = 0.3
"""Share of the shorter recording that is the other's, from which on they are refused: at the best of 600 shifts chance
makes 4.5 / sqrt(300) = 0.26 of 300 independent samples."""

MATTERS = 0.01
"""Growth of the innovations' variance below which a disagreement does not matter, however significant."""


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """What several recordings say together.

    Attributes
    ----------
    names : tuple of str
        The recordings that agree and that it is of.
    disagreeing : dict of str to float
        The others, each with the probability of so large a difference by chance.
    doubtful : tuple of str
        Recordings among ``names`` that the two-mass model is not good for by itself; the intervals may be too narrow.
    model : LinearModel
        Of the two-mass order, at the recordings' own period.
    covariance : ndarray, shape (na+nb, na+nb)
    mode : UncertainMode or None
        Its pole pair, None where the data carry none; then ``reason`` says why.
    physical : PhysicalEstimate or None
        The two-mass drive; None where there is none; then ``not_physical`` says why.
    """

    names: tuple[str, ...]
    disagreeing: dict[str, float]
    doubtful: tuple[str, ...]
    model: LinearModel
    covariance: FloatArray
    mode: UncertainMode | None
    reason: str
    physical: PhysicalEstimate | None
    not_physical: str


Together = tuple[Joint | None, str]
"""The joint estimate; without one, why."""


@dataclass(frozen=True, slots=True, eq=False)
class _Experiment:
    """One recording in the joint fit: its problem, its own minimum x and the scale of its innovations."""

    name: str  # of the recording
    problem: Problem  # its own least-squares problem
    own: FloatArray  # minimum of that alone
    std: float  # RMS of the innovations there [output unit]

    def cost(self, x: FloatArray) -> float:
        """Return ``|w|^2 / s^2``; infinite where the model is unstable."""
        with np.errstate(over="ignore", invalid="ignore"):
            w = self.problem.residual(x) / self.std
            return float(w @ w) if np.isfinite(w).all() else np.inf

    def holds_samples_of(self, other: _Experiment) -> bool:
        """Tell whether the innovations go together, at any shift: those of other samples are independent."""
        mine, its = self.problem.residual(self.own), other.problem.residual(other.own)
        size = 2 * max(mine.size, its.size)
        together = np.fft.irfft(np.fft.rfft(mine, size) * np.conj(np.fft.rfft(its, size)), size)
        shorter = self.std * other.std * min(mine.size, its.size)
        return float(np.abs(together).max()) > SAME_SAMPLES * shorter


def joint_estimate(names: Sequence[str], estimates: Sequence[BestEstimate]) -> Together:
    """Return the estimate from all recordings that agree, or why there is none.

    Parameters
    ----------
    names, estimates
        Of the recordings, one each; the estimates' two-mass fits are shared.
    """
    experiments = [
        _Experiment(name, each.problem, each.x, each.two_mass.noise.std)
        for name, each in zip(names, estimates, strict=True)
    ]
    if len(experiments) < 2:
        return None, "there is one recording"
    if len({round(each.problem.sample_time_s, 9) for each in experiments}) > 1:
        return None, "the recordings are sampled at different periods"
    for one, other in combinations(experiments, 2):
        if one.holds_samples_of(other):
            return None, f"{one.name} and {other.name} hold the same samples, which count once: leave one out"
    disagreeing: dict[str, float] = {}
    while True:
        with threadpool_limits(1):  # as `Problem.solve`
            xs, information = _solved(experiments)
        ratio = np.array([each.cost(x) - each.cost(each.own) for each, x in zip(experiments, xs, strict=True)])
        outlier = _disagreeing(experiments, ratio)
        if outlier is None:
            break
        if len(experiments) == 2:
            return None, f"{experiments[0].name} and {experiments[1].name} do not agree on one line"
        degrees = experiments[outlier].problem.orders.n_parameters
        disagreeing[experiments[outlier].name] = float(chi2.sf(ratio[outlier], degrees))
        del experiments[outlier]
    model = experiments[0].problem.model(xs[0])
    covariance: FloatArray = np.linalg.pinv(information, hermitian=True).astype(np.float64)
    mode, reason = known_pair(model, covariance, estimates[0].band_hz)
    try:
        physical, not_physical = physical_parameters(model, covariance), ""
    except BadModel as error:
        physical, not_physical = None, str(error)
    kept = tuple(each.name for each in experiments)
    good = {name for name, each in zip(names, estimates, strict=True) if _is_good(each)}
    doubtful = tuple(name for name in kept if name not in good)
    return Joint(kept, disagreeing, doubtful, model, covariance, mode, reason, physical, not_physical), ""


def _is_good(best: BestEstimate) -> bool:
    return (
        best.verdict in (ModelVerdict.GOOD, ModelVerdict.CLOSED_LOOP)
        and best.fit.model.orders == best.two_mass.model.orders
    )


def _disagreeing(experiments: Sequence[_Experiment], ratio: FloatArray) -> int | None:
    """Return which recording pays most for sharing, if they do not agree; None if they do."""
    degrees = experiments[0].problem.orders.n_parameters
    if chi2.sf(float(ratio.sum()), (len(experiments) - 1) * degrees) > SIGNIFICANCE:
        return None
    size = np.array([each.cost(each.own) for each in experiments])
    matters = ratio / size > MATTERS
    return int(np.argmax(np.where(matters, ratio, -np.inf))) if matters.any() else None


def _solved(experiments: Sequence[_Experiment]) -> tuple[list[FloatArray], FloatArray]:
    """Return the x of every recording at the joint minimum, and the information on theta there."""
    n = experiments[0].problem.orders.n_parameters
    begins = sorted((_start(experiments, leader, n) for leader in experiments), key=lambda xs: _cost(experiments, xs))
    ends = [_descended(experiments, xs, n) for xs in begins[:MOST_STARTS]]
    xs = min(ends, key=lambda xs: _cost(experiments, xs))
    slopes = [_Slopes.at(each, x, n, of_theta=True) for each, x in zip(experiments, xs, strict=True)]
    rows = np.concatenate([_without(np.linalg.qr(part.own)[0], part.shared) for part in slopes])
    return xs, rows.T @ rows


def _cost(experiments: Sequence[_Experiment], xs: Sequence[FloatArray]) -> float:
    return sum(each.cost(x) for each, x in zip(experiments, xs, strict=True))


def _start(experiments: Sequence[_Experiment], leader: _Experiment, n: int) -> list[FloatArray]:
    """Return every x with the shared parameters of one recording."""
    xs = [np.concatenate([leader.own[:n], each.own[n:]]) for each in experiments]
    return [each.problem.with_free_response(x) for each, x in zip(experiments, xs, strict=True)]


def _descended(experiments: Sequence[_Experiment], xs: list[FloatArray], n: int) -> list[FloatArray]:
    """Follow the descent by Levenberg's and Marquardt's steps to its end."""
    cost, damping, parts = _cost(experiments, xs), FIRST_DAMPING, None
    for _ in range(MOST_STEPS):
        parts = parts or [_Slopes.at(each, x, n) for each, x in zip(experiments, xs, strict=True)]
        tried = [x + step for x, step in zip(xs, _steps(parts, damping), strict=True)]
        after = _cost(experiments, tried)
        if not after < cost:
            damping *= 8.0
            if damping > MOST_DAMPING:
                break
            continue
        settled = cost - after < SETTLED * cost and damping <= FIRST_DAMPING
        xs, cost, damping, parts = tried, after, 0.125 * damping, None
        if settled:
            break
    return xs


@dataclass(frozen=True, slots=True, eq=False)
class _Slopes:
    """Whitened errors of one recording, and their slopes by what is shared and by what is its own."""

    w: FloatArray  # (N,), errors over their standard deviation
    shared: FloatArray  # (N, n), d w / d what all recordings share
    own: FloatArray  # (N, m), d w / d what is the recording's own

    @classmethod
    def at(cls, experiment: _Experiment, x: FloatArray, n: int, *, of_theta: bool = False) -> _Slopes:
        """Linearise at x; ``n`` parameters are shared."""
        J = experiment.problem.jacobian(x, of_theta=of_theta) / experiment.std
        return cls(experiment.problem.residual(x) / experiment.std, J[:, :n], J[:, n:])

    def damped(self, damping: float) -> _Slopes:
        """Append the rows of Levenberg's and Marquardt's damping of the recording's own unknowns."""
        rows = np.sqrt(damping) * np.diag(np.linalg.norm(self.own, axis=0))
        nothing = np.zeros((rows.shape[0], self.shared.shape[1]))
        return _Slopes(
            np.concatenate([self.w, rows[0] * 0.0]),
            np.concatenate([self.shared, nothing]),
            np.concatenate([self.own, rows]),
        )


def _steps(parts: Sequence[_Slopes], damping: float) -> list[FloatArray]:
    """Return the damped Gauss-Newton step of every x, what each recording has of its own eliminated."""
    damped = [part.damped(damping) for part in parts]
    factors = [np.linalg.qr(part.own) for part in damped]
    A = np.concatenate([_without(Q, part.shared) for part, (Q, _) in zip(damped, factors, strict=True)])
    r = np.concatenate([_without(Q, part.w) for part, (Q, _) in zip(damped, factors, strict=True)])
    scale = np.maximum(np.linalg.norm(A, axis=0), np.finfo(np.float64).tiny)
    rows = np.concatenate([A / scale, np.sqrt(damping) * np.eye(scale.size)])
    shared = -np.linalg.lstsq(rows, np.concatenate([r, np.zeros(scale.size)]), rcond=None)[0] / scale
    return [
        np.concatenate([shared, -np.linalg.lstsq(R, Q.T @ (part.w + part.shared @ shared), rcond=None)[0]])
        for part, (Q, R) in zip(damped, factors, strict=True)
    ]


def _without(Q: FloatArray, x: FloatArray) -> FloatArray:
    return np.asarray(x - Q @ (Q.T @ x), dtype=np.float64)
