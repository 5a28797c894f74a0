"""Adaptation-gain profiles: how a recursive estimator weighs what it has learnt against what comes.

Every profile is a choice of lambda_1(t) and lambda_2(t) in the paper's equation (5)::

    F(t+1)^-1 = lambda_1(t) F(t)^-1 + lambda_2(t) Phi(t) Phi(t)^T,      0 < lambda_1 <= 1,  0 <= lambda_2 < 2

All of I. D. Landau and G. Zito, Digital Control Systems (Springer, 2006), chapter 3, under the names they have
there. A profile is a small object of its own; what an estimator's compiled loop needs of it is :class:`GainLaw`,
the same for all of them.

The initial gain F(0) = GI times the unit matrix is a choice that each profile has: 1000 where nothing is known of
theta, at most 1 where an estimate is given as theta(0) (ibid.).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from estimator.signals.record import FloatArray
from estimator.signals.settings import Requirement, is_positive, require


@dataclass(frozen=True, slots=True)
class GainLaw:
    """What the loop carries out.

    Attributes
    ----------
    initial_gain : float
        F(0) is this times the unit matrix.
    lambda1 : float
        lambda_1(0).
    lambda0 : float
        ``lambda_1(t) = lambda0 lambda_1(t-1) + 1 - lambda0``; 1 keeps lambda_1 as it is.
    trace : float
        From the moment tr F has fallen to this value it is held there; 0 never holds it.
    alpha : float
        lambda_1(t) / lambda_2(t) while the trace is held.
    lambda2 : float
        lambda_2 before a trace is held: 1, or 0, which leaves F as it is.
    holds_at_once : bool
        tr F is held at its initial value from the first sample; ``trace`` is then not used.
    """

    initial_gain: float
    lambda1: float = 1.0
    lambda0: float = 1.0
    trace: float = 0.0
    alpha: float = 1.0
    lambda2: float = 1.0
    holds_at_once: bool = False

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
        """Return the seven numbers in the order of the loops (``gain_kernel``), shape (7,)."""
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

    initial_gain: float = 1000.0

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain)


@dataclass(frozen=True, slots=True)
class ConstantForgetting:
    """lambda_1 constant below 1, lambda_2 = 1: a sample t cycles old weighs lambda_1^t. For slow change."""

    lambda1: float = 0.99
    initial_gain: float = 1000.0

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain, lambda1=self.lambda1)


@dataclass(frozen=True, slots=True)
class VariableForgetting:
    """lambda_1 rises to 1 as ``lambda0 lambda_1 + 1 - lambda0``: only the start-up is forgotten."""

    lambda1: float = 0.97
    lambda0: float = 0.97
    initial_gain: float = 1000.0

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

    lambda1: float = 0.993
    trace: float = 0.01
    initial_gain: float = 1000.0

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain, trace=self.trace, alpha=self.lambda1)


@dataclass(frozen=True, slots=True)
class VariableForgettingThenConstantTrace:
    """The start-up is forgotten while tr F falls to ``trace``, which is then held: from a bad start to tracking."""

    lambda1: float = 0.97
    lambda0: float = 0.97
    alpha: float = 0.993
    trace: float = 0.01
    initial_gain: float = 1000.0

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain, self.lambda1, self.lambda0, self.trace, self.alpha)


@dataclass(frozen=True, slots=True)
class ConstantTrace:
    """tr F held at n GI from the first sample: tracks from the start, and never fast. For changing parameters.

    Landau and Zito name GI = 0.1 to 4 for signals of about one; the gain scales with the inverse square of theirs.
    """

    initial_gain: float = 0.1
    lambda1: float = 0.993

    @property
    def law(self) -> GainLaw:
        """The profile in the form the loops carry out."""
        return GainLaw(self.initial_gain, alpha=self.lambda1, holds_at_once=True)


@dataclass(frozen=True, slots=True)
class ConstantGain:
    """lambda_1 = 1, lambda_2 = 0: F stays F(0) ("improved gradient"). For few parameters and little noise."""

    initial_gain: float = 0.1

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
