"""The one interface of every recursive estimator, and what an estimate says about itself.

An estimator takes samples one by one (:meth:`RecursiveEstimator.update`, on the rig) or as a block
(:meth:`RecursiveEstimator.run`, from a recording); both give the same bits. In the loop nothing raises: a
sample that can't be used is masked, and an estimate that can't be trusted says so in its status, with the
reason.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.identification.linear_model import LinearModel, Orders
from estimator.signals.record import BoolArray, FloatArray

ReasonArray = NDArray[np.int8]


class Status(Enum):
    """Whether the estimate may be used."""

    UNESTIMATED = "unestimated"  # not yet: too few samples, or they do not determine it
    ESTIMATED = "estimated"
    INVALID = "invalid"  # there is one, and it is wrong
    NOT_EXCITED = "not_excited"  # the present samples say nothing of it: a chain's word, not an estimator's


class Reason(IntEnum):
    """Why an estimate has its status; the numbers are those of the compiled loops."""

    NONE = 0
    TOO_FEW_SAMPLES = 1
    NOT_EXCITED = 2
    UNSTABLE = 3
    CONSTANT_OUTPUT = 4

    @property
    def status(self) -> Status:
        """The status that goes with the reason."""
        return _STATUS[self]

    @property
    def message(self) -> str:
        """What is wrong and what to do, for a reader at the rig."""
        return _MESSAGES[self]


_STATUS = {
    Reason.NONE: Status.ESTIMATED,
    Reason.TOO_FEW_SAMPLES: Status.UNESTIMATED,
    Reason.NOT_EXCITED: Status.UNESTIMATED,
    Reason.UNSTABLE: Status.INVALID,
    Reason.CONSTANT_OUTPUT: Status.UNESTIMATED,
}

_MESSAGES = {
    Reason.NONE: "",
    Reason.TOO_FEW_SAMPLES: "too few good samples yet; wait, or look why samples are masked",
    Reason.NOT_EXCITED: "the samples do not determine every parameter; switch the PRBS on or raise it",
    Reason.UNSTABLE: "the estimated A has a pole on or outside the unit circle; wait, or lower its order",
    Reason.CONSTANT_OUTPUT: "the measured output never changes; check the sensor and its scale",
}


def statement(reason: Reason, undetermined: tuple[str, ...]) -> str:
    """Return the message of a reason with the names of the parameters it is about; empty where nothing is wrong."""
    names = ", ".join(undetermined) if reason.status is Status.UNESTIMATED else ""
    return f"{names}: {reason.message}" if names else reason.message


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """State of an estimation after one sample.

    Attributes
    ----------
    theta : ndarray, shape (na+nb,)
        ``a_1 .. a_na, b_1 .. b_nb``; always finite. A copy: later samples do not change it.
    reason : Reason
        Why the status is what it is.
    used : bool
        False if this sample was masked; theta did not change and the errors are 0.
    y_hat : float
        Predicted output, a posteriori [output unit]: a simulation or one step ahead, as the estimator says.
    e_prior, e_post : float
        Prediction error with the parameters before and after this sample [output unit].
    """

    theta: FloatArray
    reason: Reason
    used: bool
    y_hat: float
    e_prior: float
    e_post: float

    @property
    def status(self) -> Status:
        """Whether the estimate may be used."""
        return self.reason.status


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Every estimate of a block.

    Attributes
    ----------
    theta : ndarray, shape (N, na+nb)
    y_hat, e_prior, e_post : ndarray, shape (N,)
    used : ndarray of bool, shape (N,)
    reason : ndarray of int, shape (N,)
        Values of :class:`Reason`.
    extra : ndarray, shape (N, m)
        What the estimator holds besides theta (noise model, masses and stiffness); m is often 0.
    extra_names : tuple of str
        Names of its columns.
    """

    theta: FloatArray
    y_hat: FloatArray
    e_prior: FloatArray
    e_post: FloatArray
    used: BoolArray
    reason: ReasonArray
    extra: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    extra_names: tuple[str, ...] = ()

    def __len__(self) -> int:
        return int(self.theta.shape[0])

    def __getitem__(self, k: int) -> Estimate:
        """Return the estimate after sample ``k`` of the block."""
        return Estimate(
            theta=self.theta[k].copy(),
            reason=Reason(int(self.reason[k])),
            used=bool(self.used[k]),
            y_hat=float(self.y_hat[k]),
            e_prior=float(self.e_prior[k]),
            e_post=float(self.e_post[k]),
        )


class RecursiveEstimator(Protocol):
    """What every recursive estimator offers."""

    @property
    def orders(self) -> Orders:
        """Structure of the model."""
        ...

    @property
    def theta(self) -> FloatArray:
        """Present parameters, shape (na+nb,), a copy."""
        ...

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters the samples so far do not determine."""
        ...

    @property
    def extra_names(self) -> tuple[str, ...]:
        """Names of what it holds besides theta; see :attr:`Trajectory.extra`."""
        ...

    def update(self, u: float, y: float, okay: bool = True) -> Estimate:
        """Take one sample."""
        ...

    def run(self, u: FloatArray, y: FloatArray, okay: BoolArray) -> Trajectory:
        """Take a block of samples, each array of shape (N,)."""
        ...

    def model(self, sample_time_s: float) -> LinearModel:
        """Return the present parameters as a model."""
        ...

    def statement(self, reason: Reason) -> str:
        """Return what is wrong with an estimate of that reason, naming the parameters, and what to do."""
        ...

    def state(self) -> dict[str, Any]:
        """Return everything it remembers, as plain arrays; :mod:`estimator.identification.online.state`."""
        ...

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up a saved state; what follows has the bits it would have had without the break."""
        ...
