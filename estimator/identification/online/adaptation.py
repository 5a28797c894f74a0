"""Adaptation-gain profiles: how a recursive estimator weighs what it has learnt against what comes.

Every profile is a choice of lambda_1(t) and lambda_2(t) in the paper's equation (5)::

    F(t+1)^-1 = lambda_1(t) F(t)^-1 + lambda_2(t) Phi(t) Phi(t)^T,      0 < lambda_1 <= 1,  0 <= lambda_2 < 2

The initial gain F(0) = GI times the unit matrix is a choice that each profile has: 1000 where nothing is known of
theta, at most 1 where an estimate is given as theta(0) (ibid.).

All of I. D. Landau and G. Zito, Digital Control Systems (Springer, 2006), chapter 3, under the names they have
there. A profile is a small object of its own; what an estimator's compiled loop needs of it is :class:`GainLaw`,
the same for all of them.

F is kept as U D U^T (U unit upper triangular, D diagonal) and updated after G. J. Bierman, Factorization Methods for
Discrete Sequential Estimation (Academic Press, 1977), chapter V: it can then not lose symmetry or turn indefinite by
rounding, however long the run. Row j of the array ``U`` is *column* j of U, with its unit diagonal and the zeros below
it: the inner loops run over whole rows of fixed length, which a compiler turns into vector instructions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from estimator.compiled import inlined
from estimator.identification.online.recursive import Parts
from estimator.signals.record import FloatArray
from estimator.signals.settings import Requirement, is_positive, require

# Places in `law`, see GainLaw.as_array.
INITIAL_GAIN, LAMBDA1, LAMBDA0, LAMBDA2, TRACE, ALPHA, HOLDS_AT_ONCE = range(7)

# Places in `live` that belong to the gain.
LAMBDA1_NOW = 0
HOLDS_TRACE = 1  # 1 while tr F is held

INFORMATION_GAIN = 1000.0  # start of the gain that tells what the samples determine, where F itself can't


@dataclass(frozen=True, slots=True)
class GainLaw:
    """What the loop carries out."""

    initial_gain: float  # F(0) is this times the unit matrix
    lambda1: float = 1.0  # lambda_1(0)
    lambda0: float = 1.0  # ``lambda_1(t) = lambda0 lambda_1(t-1) + 1 - lambda0``
    trace: float = 0.0  # from the moment tr F has fallen to this value it is held there
    alpha: float = 1.0  # lambda_1(t) / lambda_2(t) while the trace is held
    lambda2: float = 1.0  # lambda_2 before a trace is held
    holds_at_once: bool = False  # tr F is held at its initial value from the first sample

    def __post_init__(self) -> None:
        factor = "a factor above 0 and at most 1"
        require(
            "adaptation gain",
            (
                Requirement("initial_gain", self.initial_gain, is_positive(self.initial_gain), "above 0"),
                Requirement("lambda1", self.lambda1, 0 < self.lambda1 <= 1, factor),
                Requirement("lambda0", self.lambda0, 0 < self.lambda0 <= 1, factor),
                Requirement("trace", self.trace, self.trace == 0 or is_positive(self.trace), "0 or above"),
                Requirement("alpha", self.alpha, 0.5 < self.alpha <= 1, "above 0.5 (lambda_2 < 2) up to 1"),
                Requirement("lambda2", self.lambda2, self.lambda2 in (0, 1), "0 or 1"),
            ),
        )

    @property
    def informs_by_itself(self) -> bool:
        """Tell whether F falls as the samples determine more, as it does not where it is constant or its trace is."""
        return self.lambda2 != 0 and not self.holds_at_once

    def as_array(self, n_parameters: int) -> FloatArray:
        """Return the seven numbers in the order of the loops below, shape (7,)."""
        trace = n_parameters * self.initial_gain if self.holds_at_once else self.trace
        return np.array(
            [self.initial_gain, self.lambda1, self.lambda0, self.lambda2, trace, self.alpha, float(self.holds_at_once)]
        )


class Adaptation(Protocol):
    """An adaptation-gain profile."""

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        ...


@dataclass(frozen=True, slots=True)
class DecreasingGain:
    """lambda_1 = lambda_2 = 1: every sample weighs the same. For a system that does not change."""

    initial_gain: float = 1000.0  # F(0) = initial_gain I

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain)


@dataclass(frozen=True, slots=True)
class ConstantForgetting:
    """lambda_1 constant below 1, lambda_2 = 1: a sample t cycles old weighs lambda_1^t. For slow change."""

    lambda1: float = 0.99  # forgetting factor, 0 to 1
    initial_gain: float = 1000.0  # F(0) = initial_gain I

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain, lambda1=self.lambda1)


@dataclass(frozen=True, slots=True)
class VariableForgetting:
    """lambda_1 rises to 1 as ``lambda0 lambda_1 + 1 - lambda0``: only the start-up is forgotten."""

    lambda1: float = 0.97  # first forgetting factor, 0 to 1
    lambda0: float = 0.97  # how slowly it rises, 0 to 1
    initial_gain: float = 1000.0  # F(0) = initial_gain I

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain, lambda1=self.lambda1, lambda0=self.lambda0)


@dataclass(frozen=True, slots=True)
class DecreasingThenConstantTrace:
    """Decreasing gain until tr F has fallen to ``trace``, which is then held: fast start, then tracking.

    The paper's profile. While the trace is held, lambda_1(t) and lambda_2(t) follow from it and from their
    constant ratio alpha. The paper gives "lambda_1 = 0.993" next to "tr F(0) = 0.01"; since lambda_1(t) itself
    is fixed by the trace, its number is taken as the ratio (lambda_1 for lambda_2 = 1).
    """

    lambda1: float = 0.993  # lambda_1 / lambda_2 once the trace is held
    trace: float = 0.01
    initial_gain: float = 1000.0  # F(0) = initial_gain I

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain, trace=self.trace, alpha=self.lambda1)


@dataclass(frozen=True, slots=True)
class VariableForgettingThenConstantTrace:
    """The start-up is forgotten while tr F falls to ``trace``, which is then held: from a bad start to tracking."""

    lambda1: float = 0.97  # first forgetting factor, 0 to 1
    lambda0: float = 0.97  # how slowly it rises, 0 to 1
    alpha: float = 0.993  # lambda_1 / lambda_2 once the trace is held
    trace: float = 0.01
    initial_gain: float = 1000.0  # F(0) = initial_gain I

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain, self.lambda1, self.lambda0, self.trace, self.alpha)


@dataclass(frozen=True, slots=True)
class ConstantTrace:
    """tr F held at n GI from the first sample: tracks from the start, and never fast. For changing parameters.

    Landau and Zito name GI = 0.1 to 4 for signals of about one; the gain scales with the inverse square of theirs.
    """

    initial_gain: float = 0.1  # GI: the trace held is n GI
    lambda1: float = 0.993  # lambda_1 / lambda_2

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain, alpha=self.lambda1, holds_at_once=True)


@dataclass(frozen=True, slots=True)
class ConstantGain:
    """lambda_1 = 1, lambda_2 = 0: F stays F(0) ("improved gradient"). For few parameters and little noise."""

    initial_gain: float = 0.1  # F = initial_gain I, always

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain, lambda2=0.0)


PROFILES: tuple[type[Adaptation], ...] = (
    DecreasingGain,
    ConstantForgetting,
    VariableForgetting,
    DecreasingThenConstantTrace,
    VariableForgettingThenConstantTrace,
    ConstantTrace,
    ConstantGain,
)
"""Every profile."""


@inlined
def dot(a: FloatArray, b: FloatArray) -> float:
    """Return a^T b; a plain loop, since calling a library takes longer than eight products."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@inlined
def project(Phi: FloatArray, U: FloatArray, f: FloatArray) -> None:
    """Set f = U^T Phi."""
    for j in range(Phi.shape[0]):
        total = Phi[j]
        for i in range(j):
            total += U[j, i] * Phi[i]
        f[j] = total


@inlined
def gain(Phi: FloatArray, U: FloatArray, D: FloatArray, g: FloatArray, f: FloatArray) -> float:
    """Set g = F Phi and return Phi^T F Phi."""
    n = Phi.shape[0]
    project(Phi, U, f)
    s = 0.0
    for i in range(n):
        g[i] = 0.0
    for j in range(n):
        v = D[j] * f[j]
        s += f[j] * v
        for i in range(n):
            g[i] += U[j, i] * v
    return s


@inlined
def absorb(Phi: FloatArray, ratio: float, U: FloatArray, D: FloatArray, g: FloatArray, f: FloatArray) -> float:
    """Take Phi into the factors, F - F Phi Phi^T F / (ratio + Phi^T F Phi); g and the result as of :func:`gain`."""
    n = Phi.shape[0]
    project(Phi, U, f)
    s = 0.0
    before = ratio
    weight = 1.0 / before
    for i in range(n):
        g[i] = 0.0
    for j in range(n):
        v = D[j] * f[j]
        s += f[j] * v
        after = before + f[j] * v
        share = f[j] * weight
        weight = 1.0 / after
        D[j] *= before * weight
        for i in range(n):
            u_ij = U[j, i]
            U[j, i] = u_ij - g[i] * share
            g[i] += u_ij * v
        before = after
    return s


@inlined
def diagonal(U: FloatArray, D: FloatArray, diag: FloatArray) -> float:
    """Set diag = diag F and return tr F."""
    n = D.shape[0]
    for i in range(n):
        diag[i] = 0.0
    for j in range(n):
        for i in range(n):
            diag[i] += U[j, i] * U[j, i] * D[j]
    trace = 0.0
    for i in range(n):
        trace += diag[i]
    return trace


@inlined
def scale_of(trace: float, m: Parts) -> float:
    """Return what F is multiplied by after a sample was absorbed: 1 / lambda_1, as the profile has it."""
    if m.live[HOLDS_TRACE] == 1.0:
        return float(m.law[TRACE] / trace)
    if trace <= m.live[LAMBDA1_NOW] * m.law[INITIAL_GAIN] * m.D.shape[0]:
        return float(1.0 / m.live[LAMBDA1_NOW])
    return 1.0  # without excitation nothing is forgotten: F would grow beyond every bound


@inlined
def learn(Phi: FloatArray, m: Parts) -> float:
    """Update F by equation (5) with the lambdas of the profile; g = F Phi and Phi^T F Phi are of the F before."""
    live, law = m.live, m.law
    s = absorb(Phi, law[ALPHA] if live[HOLDS_TRACE] == 1.0 else live[LAMBDA1_NOW], m.U, m.D, m.g, m.f)
    trace = diagonal(m.U, m.D, m.diagonal)
    scale = scale_of(trace, m)
    for i in range(m.D.shape[0]):
        m.D[i] *= scale
        m.diagonal[i] *= scale
    live[LAMBDA1_NOW] = law[LAMBDA0] * live[LAMBDA1_NOW] + 1.0 - law[LAMBDA0]
    if trace * scale <= law[TRACE]:
        live[HOLDS_TRACE] = 1.0
    return s


@inlined
def informs_by_itself(law: FloatArray) -> bool:
    """Tell whether diag F falls as the samples determine more; a constant gain and a constant trace do not."""
    return bool(law[LAMBDA2] != 0.0 and law[HOLDS_AT_ONCE] == 0.0)


@inlined
def adapt(Phi: FloatArray, m: Parts) -> float:
    """Update whatever the profile has; g = F Phi and Phi^T F Phi are of the F before."""
    by_itself = informs_by_itself(m.law)
    if not by_itself:
        absorb(Phi, 1.0, m.known_U, m.known_D, m.g, m.f)
    s = gain(Phi, m.U, m.D, m.g, m.f) if m.law[LAMBDA2] == 0.0 else learn(Phi, m)
    if not by_itself:
        diagonal(m.known_U, m.known_D, m.diagonal)
    return s
