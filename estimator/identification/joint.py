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
from estimator.identification.best import BestEstimate, known_pair
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
    model: LinearModel
    covariance: FloatArray
    mode: UncertainMode | None
    reason: str
    physical: PhysicalEstimate | None
    not_physical: str


Together = tuple[Joint | None, str]
"""The joint estimate; without one, why."""


@dataclass(frozen=True, slots=True, eq=False)
class _Share:
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
    shares = [
        _Share(name, each.problem, each.x, each.two_mass.noise.std) for name, each in zip(names, estimates, strict=True)
    ]
    if len(shares) < 2:
        return None, "there is one recording"
    if len({round(each.problem.sample_time_s, 9) for each in shares}) > 1:
        return None, "the recordings are sampled at different periods"
    disagreeing: dict[str, float] = {}
    while True:
        with threadpool_limits(1):  # as `Problem.solve`
            xs, information = _solved(shares)
        paid = np.array([share.cost(x) - share.cost(share.own) for share, x in zip(shares, xs, strict=True)])
        odd_one = _disagreeing(shares, paid)
        if odd_one is None:
            break
        if len(shares) == 2:
            return None, f"{shares[0].name} and {shares[1].name} do not agree on one line"
        degrees = shares[odd_one].problem.orders.n_parameters
        disagreeing[shares[odd_one].name] = float(chi2.sf(paid[odd_one], degrees))
        del shares[odd_one]
    model = shares[0].problem.model(xs[0])
    covariance: FloatArray = np.linalg.pinv(information, hermitian=True).astype(np.float64)
    mode, reason = known_pair(model, covariance, estimates[0].band_hz)
    try:
        physical, not_physical = physical_parameters(model, covariance), ""
    except BadModel as error:
        physical, not_physical = None, str(error)
    kept = tuple(share.name for share in shares)
    return Joint(kept, disagreeing, model, covariance, mode, reason, physical, not_physical), ""


def _disagreeing(shares: Sequence[_Share], paid: FloatArray) -> int | None:
    """Return which recording pays most for sharing, if they do not agree; None if they do."""
    degrees = shares[0].problem.orders.n_parameters
    if chi2.sf(float(paid.sum()), (len(shares) - 1) * degrees) > SIGNIFICANCE:
        return None
    size = np.array([share.cost(share.own) for share in shares])
    matters = paid / size > MATTERS
    return int(np.argmax(np.where(matters, paid, -np.inf))) if matters.any() else None


def _solved(shares: Sequence[_Share]) -> tuple[list[FloatArray], FloatArray]:
    """Return the x of every recording at the joint minimum, and the information on theta there."""
    n = shares[0].problem.orders.n_parameters
    xs = _start(shares, n)
    cost = sum(share.cost(x) for share, x in zip(shares, xs, strict=True))
    for _ in range(MOST_STEPS):
        steps = _gauss_newton(shares, xs, n)
        size = 1.0
        while size >= SMALLEST_STEP:
            tried = [x + size * step for x, step in zip(xs, steps, strict=True)]
            after = sum(share.cost(x) for share, x in zip(shares, tried, strict=True))
            if after < cost:
                break
            size *= 0.5
        else:
            break
        settled = cost - after < SETTLED * cost
        xs, cost = tried, after
        if settled:
            break
    rows = np.concatenate([_reduced(share, x, n, of_theta=True)[0] for share, x in zip(shares, xs, strict=True)])
    return xs, rows.T @ rows


def _start(shares: Sequence[_Share], n: int) -> list[FloatArray]:
    """Return every x with the parameters of the one recording that suits all of them best."""
    candidates = [
        [np.concatenate([leader.own[:n], share.own[n:]]) for share in shares]
        for leader in shares
    ]  # fmt: skip
    started = [[share.problem.with_free_response(x) for share, x in zip(shares, xs, strict=True)] for xs in candidates]
    return min(started, key=lambda xs: sum(share.cost(x) for share, x in zip(shares, xs, strict=True)))


def _reduced(
    share: _Share, x: FloatArray, n: int, *, of_theta: bool = False
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return slopes by the shared parameters and residual, without what the recording's own ones explain; and Q, R."""
    w = share.problem.residual(x) / share.std
    J = share.problem.jacobian(x, of_theta=of_theta) / share.std
    Q, R = np.linalg.qr(J[:, n:])
    return J[:, :n] - Q @ (Q.T @ J[:, :n]), w - Q @ (Q.T @ w), Q, R, J[:, :n]


def _gauss_newton(shares: Sequence[_Share], xs: Sequence[FloatArray], n: int) -> list[FloatArray]:
    parts = [_reduced(share, x, n) for share, x in zip(shares, xs, strict=True)]
    A, r = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    scale = np.maximum(np.linalg.norm(A, axis=0), np.finfo(np.float64).tiny)
    shared = -np.linalg.lstsq(A / scale, r, rcond=None)[0] / scale
    steps = []
    for share, x, (_, _, Q, R, J) in zip(shares, xs, parts, strict=True):
        w = share.problem.residual(x) / share.std
        own = -np.linalg.lstsq(R, Q.T @ (w + J @ shared), rcond=None)[0]
        steps.append(np.concatenate([shared, own]))
    return steps
