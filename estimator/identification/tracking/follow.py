"""The resonance of every estimate, and how sure it is: standard deviations while driving.

For any recursive estimator of an output-error model. With theta* for the truth and w for the noise in the output,
the prediction error is, to first order, ``e0(t) = w(t) - psi(t-1)^T (theta(t-1) - theta*)``, psi the gradient of the
prediction. Whatever its adaptation law, the estimator corrects by ``theta(t) - theta(t-1) = K(t) e0(t)``. So the
covariance of its error is::

    P(t) = (I - K psi^T) P(t-1) (I - K psi^T)^T + S K K^T

and K is *seen*, not assumed: it is the correction made, divided by the error it was made for. Forgetting, a held
trace, masks and a frozen estimate are in it without being known here. From P follows, by the gradient of the poles
(:mod:`pole_kernel`), the standard deviation of frequency and damping.

**The noise S.** The residual is coloured (road, aliasing, what the model lacks), and what counts is its density where
psi has its own: at the resonance. Hence S is the residual's density there, found by passing it twice through the
resonance's own pole, which weighs it as psi^2 does, and relating the mean square to what a white residual would give
(L. Ljung, System Identification, 2nd ed. 1999, (9.54): the covariance of the estimate with the noise spectrum under
the integral). The mean runs over the last :data:`MEMORY` samples.

**The gradient psi** is phi / A. Only the resonance's own pair of A is taken as a filter, the rest as the number it
amounts to at the resonance: what a spare pole does, close to the unit circle or to a zero, says nothing about the
resonance, and made P wander.

What it does not hold: the lag of an estimate that forgets behind a driveline that changes, and errors of first order
in theta right after the start. Before :data:`FEWEST` samples of a usable estimate no standard deviation is given: at
150 samples the first-order theory was too sure by a factor of 2.5, at 300 it was right within a quarter
(``python -m tests.benchmarks.tracking``). Where the residual is a deterministic error of the model, repeated with
every period of the PRBS, the deviations are too large by up to two: they take it for noise.

Without excitation the deviations grow (:mod:`excitation`), up to those of a value that may be anywhere in the band in
which the resonance is looked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimator.identification.linear_model import Orders
from estimator.identification.modes.modes import LIGHTLY_DAMPED
from estimator.identification.online.recursive import Trajectory
from estimator.identification.tracking.excitation import CLOSES, OPENS, Excitation
from estimator.identification.tracking.excitation_kernel import (
    N_BLOCK,
    N_LASTING,
    N_MODE,
    SAMPLES,
    VERDICT,
)
from estimator.identification.tracking.follow_kernel import follow_block
from estimator.identification.tracking.sensitivity_kernel import N_THROUGH
from estimator.signals.record import BoolArray, FloatArray

MEMORY = 500
"""Kept samples over which the residual's density is averaged: 10 s at 20 ms, some thirty times the memory of a mode at
8 Hz and a damping of 0.06, so that S is known within a fifth."""

FEWEST = 240
"""Samples of a usable estimate before a standard deviation is given."""


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """The resonance of every estimate of a block, each array of shape (n,); NaN where there is none."""

    frequency_hz: FloatArray
    damping: FloatArray
    height: FloatArray
    frequency_std_hz: FloatArray
    damping_std: FloatArray


class Follower:
    """The recursion with its state; memory does not grow.

    Parameters
    ----------
    orders : Orders
        Structure of the models that will come; na of 2 or more.
    sample_time_s : float
        Their sampling period [s].
    band_hz : tuple of float
        Where the resonance is looked for [Hz].
    block : int
        Samples of a block, at the end of which the excitation is judged.
    """

    def __init__(self, orders: Orders, sample_time_s: float, band_hz: tuple[float, float], block: int) -> None:
        n = orders.n_parameters
        self._block = block
        self._structure = np.array([orders.na, orders.nb, orders.nk])
        self._numbers = np.array([sample_time_s, *band_hz, LIGHTLY_DAMPED, MEMORY, FEWEST, block, OPENS, CLOSES])
        depth = max(orders.na, orders.nk + orders.nb, 2)
        self._live = {
            "before": np.zeros(n),
            "pair": np.zeros(3),
            "P": np.eye(n),  # forgotten with the estimator's own start value, whatever it is
            "past": np.zeros((4, depth)),
            "heard": np.zeros(6),
            "mode": np.zeros(N_MODE),
            "through": np.zeros(N_THROUGH),
            "block": np.zeros(N_BLOCK),
            "lasting": np.zeros(N_LASTING),
        }
        self._roots = np.zeros(orders.na, dtype=np.complex128)
        self._work = np.zeros((7, max(n, 3)))

    @property
    def excitation(self) -> Excitation:
        """Verdict on the last whole block."""
        return Excitation(int(self._live["lasting"][VERDICT]))

    @property
    def to_block_end(self) -> int:
        """Samples until the next verdict, 1 or more."""
        return self._block - int(self._live["block"][SAMPLES])

    @property
    def at_block_end(self) -> bool:
        """Whether the last sample was the last of a block, so that the verdict is new."""
        return self.to_block_end == self._block

    def run(self, u: FloatArray, okay: BoolArray, estimates: Trajectory) -> Followed:
        """Follow the estimates of a block, which may have any length.

        Parameters
        ----------
        u : ndarray, shape (n,)
            Inputs that they were made from.
        okay : ndarray of bool, shape (n,)
            Which samples are good, whether the estimator was held or not.
        estimates : Trajectory
            The estimates, length n.
        """
        live, out = self._live, np.empty((len(estimates), 5))
        follow_block(
            u,
            okay,
            estimates.theta,
            estimates.y_hat,
            estimates.e_prior,
            estimates.used,
            estimates.reason,
            self._structure,
            self._numbers,
            live["before"],
            live["pair"],
            live["P"],
            live["past"],
            live["heard"],
            live["mode"],
            live["through"],
            live["block"],
            live["lasting"],
            self._work,
            self._roots,
            out,
        )
        return Followed(*(np.ascontiguousarray(column) for column in out.T))

    def state(self) -> dict[str, FloatArray]:
        """Return the state, copied."""
        return {name: values.copy() for name, values in self._live.items()} | {"roots": self._roots.view(float).copy()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a state of a follower with the same settings."""
        for name, values in self._live.items():
            values[:] = state[name]
        self._roots.view(float)[:] = state["roots"]
