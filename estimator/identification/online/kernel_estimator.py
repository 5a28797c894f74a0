"""What every recursive estimator here is made of: a compiled loop, its memory, and the common interface around them.

An estimator of its own brings the loop and fills the memory; taking samples, status, saving and restoring are here once
for all. A single sample is a block of one: the same machine code, so the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.errors import BadShape
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.online.state import State, restored, saved
from estimator.identification.online.memory import Memory
from estimator.identification.online.recursive import Estimate, Reason, Trajectory, statement
from estimator.identification.online.regression_kernel import OUTPUT_MOVES, TORQUE_MOVES
from estimator.signals.record import BoolArray, FloatArray

_REASONS = tuple(Reason)


Block = Callable[..., None]
"""A compiled loop: ``block(u, y, okay, memory, out)``, one row of ``out`` (:func:`row_type`) for each sample."""


def row_type(n_parameters: int, n_extra: int) -> np.dtype[np.void]:
    """Return the type of a row of results: :class:`Estimate` as the compiled loops write it."""
    numbers = [(name, np.float64) for name in ("y_hat", "e_prior", "e_post")]
    vectors = [("theta", np.float64, (n_parameters,)), ("extra", np.float64, (n_extra,))]
    return np.dtype([*vectors, *numbers, ("used", np.bool_), ("reason", np.int8)], align=True)


class KernelEstimator:
    """A recursive estimator around compiled loops; memory does not grow.

    Parameters
    ----------
    name : str
        What the registry and saved states call it.
    block : callable
        Its compiled loop.
    orders : Orders
        Structure of the model it gives.
    memory : Memory
        With its start values.
    extra_names : tuple of str
        What it holds besides theta, in the columns after it.
    """

    def __init__(
        self,
        name: str,
        block: Block,
        orders: Orders,
        memory: Memory,
        extra_names: tuple[str, ...] = (),
    ) -> None:
        self._name, self._block, self._orders = name, block, orders
        self._memory, self._extra_names = memory, extra_names
        self._row = np.zeros(1, row_type(orders.n_parameters, len(extra_names)))
        self._row_theta = self._row["theta"][0]
        self._row_rest = self._row[["reason", "used", "y_hat", "e_prior", "e_post"]]
        self._u, self._y, self._okay = np.zeros(1), np.zeros(1), np.ones(1, dtype=np.bool_)
        # An empty block compiles the loop now, so that the first cycle on the rig does not wait for it.
        self.run(np.empty(0), np.empty(0), np.empty(0, dtype=np.bool_))

    @property
    def name(self) -> str:
        """What the registry and saved states call it."""
        return self._name

    @property
    def orders(self) -> Orders:
        """Structure of the model."""
        return self._orders

    @property
    def theta(self) -> FloatArray:
        """Present parameters ``a_1 .. a_na, b_1 .. b_nb``, a copy."""
        return self._memory["theta"][: self._orders.n_parameters].copy()

    @property
    def extra_names(self) -> tuple[str, ...]:
        """Names of what it estimates besides theta; see :attr:`Trajectory.extra`."""
        return self._extra_names

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters the samples so far do not determine."""
        raise NotImplementedError

    def model(self, sample_time_s: float) -> LinearModel:
        """Return the present parameters as a model."""
        return LinearModel.from_theta(self.theta, self._orders, sample_time_s)

    def statement(self, reason: Reason) -> str:
        """Return what is wrong with an estimate of that reason, naming the parameters, and what to do; or nothing."""
        return statement(reason, self.undetermined)

    def update(self, u: float, y: float, okay: bool = True) -> Estimate:
        """Take one sample; correct ``theta`` by the error of the prediction.

        Parameters
        ----------
        u : float
            Total torque of this sample [Nm].
        y : float
            Speed of this sample [rad/s].
        okay : bool
            False masks the sample: time advances, ``theta`` does not change. A value that is not finite masks
            it too.

        Returns
        -------
        Estimate
            Parameters, status with reason, and errors.

        Notes
        -----
        Cost and memory do not depend on the samples before. Never raises on a value.
        """
        self._u[0], self._y[0], self._okay[0] = u, y, okay
        self._advance(self._u, self._y, self._okay, self._row)
        reason, *rest = self._row_rest.item()
        return Estimate(self._row_theta.copy(), _REASONS[reason], *rest)

    def run(self, u: FloatArray, y: FloatArray, okay: BoolArray) -> Trajectory:
        """Take a block of samples, with the same bits as one by one.

        Parameters
        ----------
        u, y, okay : ndarray, shape (N,)
            Input, output, mask. They are not changed.

        Returns
        -------
        Trajectory
            Every estimate of the block.

        Raises
        ------
        BadShape
            If the three do not have one shape (N,).
        """
        if not (u.ndim == 1 and u.shape == y.shape == okay.shape):
            raise BadShape(
                f"{self._name}: u, y and okay have the shapes {u.shape}, {y.shape}, {okay.shape}, expected one shape "
                "(N,). Give every signal one value per sample."
            )
        out = np.empty(u.shape[0], self._row.dtype)
        self._advance(
            np.ascontiguousarray(u, dtype=np.float64),
            np.ascontiguousarray(y, dtype=np.float64),
            np.ascontiguousarray(okay, dtype=np.bool_),
            out,
        )
        return Trajectory(**{name: out[name] for name in self._row.dtype.names or ()}, extra_names=self._extra_names)

    def _advance(self, u: FloatArray, y: FloatArray, okay: BoolArray, out: NDArray[np.void]) -> None:
        self._block(u, y, okay, self._memory.record, out)

    @property
    def _stands_still(self) -> bool:
        """Whether a signal has never changed, so that nothing is determined whatever the gain says."""
        live = self._memory["live"]
        return bool(live[TORQUE_MOVES] == 0.0 or live[OUTPUT_MOVES] == 0.0)

    def state(self) -> State:
        """Return everything it remembers, as plain arrays; see :mod:`estimator.identification.online.state`."""
        return saved(self._name, self._memory)

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up a saved state: what follows has the bits it would have had without the break.

        Raises
        ------
        BadSetting
            If the state is not that of an estimator of this kind and these settings.
        """
        restored(state, self._name, self._memory)
