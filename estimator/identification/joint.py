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

import numpy as np
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from estimator.errors import BadModel
from estimator.identification.best import BestEstimate, Verdict, known_pair
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.physical import PhysicalEstimate, physical_parameters
from estimator.identification.modes.uncertainty import UncertainMode
from estimator.identification.offline.problem import SETTLED, Problem
from estimator.signals.record import FloatArray

MOST_STEPS = 30
SMALLEST_STEP = 1e-3
"""Share of a Gauss-Newton step below which it is given up."""

SIGNIFICANCE = 0.001
"""False alarms of the agreement, on recordings of one drive."""

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

    name: str
    problem: Problem
    own: FloatArray
    std: float

    def cost(self, x: FloatArray) -> float:
        """Return ``|w|^2 / s^2``; infinite where the model is unstable."""
        with np.errstate(over="ignore", invalid="ignore"):
            w = self.problem.residual(x) / self.std
            return float(w @ w) if np.isfinite(w).all() else np.inf


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
    return best.verdict in (Verdict.GOOD, Verdict.CLOSED_LOOP) and best.fit.model.orders == best.two_mass.model.orders


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
    xs = _start(experiments, n)
    cost = sum(each.cost(x) for each, x in zip(experiments, xs, strict=True))
    for _ in range(MOST_STEPS):
        steps = _gauss_newton(experiments, xs, n)
        size = 1.0
        while size >= SMALLEST_STEP:
            tried = [x + size * step for x, step in zip(xs, steps, strict=True)]
            after = sum(each.cost(x) for each, x in zip(experiments, tried, strict=True))
            if after < cost:
                break
            size *= 0.5
        else:
            break
        settled = cost - after < SETTLED * cost
        xs, cost = tried, after
        if settled:
            break
    rows = np.concatenate([_reduced(each, x, n, of_theta=True)[0] for each, x in zip(experiments, xs, strict=True)])
    return xs, rows.T @ rows


def _start(experiments: Sequence[_Experiment], n: int) -> list[FloatArray]:
    """Return every x with the parameters of the one recording that suits all of them best."""
    candidates = [
        [np.concatenate([leader.own[:n], each.own[n:]]) for each in experiments]
        for leader in experiments
    ]  # fmt: skip
    started = [
        [each.problem.with_free_response(x) for each, x in zip(experiments, xs, strict=True)] for xs in candidates
    ]
    return min(started, key=lambda xs: sum(each.cost(x) for each, x in zip(experiments, xs, strict=True)))


def _reduced(
    experiment: _Experiment, x: FloatArray, n: int, *, of_theta: bool = False
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return slopes by the shared parameters and residual, without what the recording's own ones explain; and Q, R."""
    w = experiment.problem.residual(x) / experiment.std
    J = experiment.problem.jacobian(x, of_theta=of_theta) / experiment.std
    Q, R = np.linalg.qr(J[:, n:])
    return J[:, :n] - Q @ (Q.T @ J[:, :n]), w - Q @ (Q.T @ w), Q, R, J[:, :n]


def _gauss_newton(experiments: Sequence[_Experiment], xs: Sequence[FloatArray], n: int) -> list[FloatArray]:
    parts = [_reduced(each, x, n) for each, x in zip(experiments, xs, strict=True)]
    A, r = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    scale = np.maximum(np.linalg.norm(A, axis=0), np.finfo(np.float64).tiny)
    shared = -np.linalg.lstsq(A / scale, r, rcond=None)[0] / scale
    steps = []
    for each, x, (_, _, Q, R, J) in zip(experiments, xs, parts, strict=True):
        w = each.problem.residual(x) / each.std
        own = -np.linalg.lstsq(R, Q.T @ (w + J @ shared), rcond=None)[0]
        steps.append(np.concatenate([shared, own]))
    return steps
