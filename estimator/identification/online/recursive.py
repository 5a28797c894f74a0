"""Recursive estimators: their one interface, and what an estimate says about itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.errors import BadSetting, BadShape
from estimator.identification.linear_model import LinearModel, Orders
from estimator.signals.record import BoolArray, FloatArray

Parts = Any
"""The record inside a compiled loop: numba's own type, which has no name in Python. Its parts are its attributes."""

Shapes = Mapping[str, tuple[int, ...]]


# Places in `live` after those of the gain.
USED = 2  # samples that corrected theta
PEAK = 3  # largest output seen
HELD_SAMPLES = 4  # samples until the regressor is free of torques that were held in place of missing ones
HELD_OUTPUTS = 5  # the same of outputs
IS_STABLE = 6  # 1 while A_hat is stable
BEGUN = 7  # 1 after the first torque
TORQUE_MOVES = 8  # 1 once the torque has changed
OUTPUT_MOVES = 9  # 1 once the output has
LAST_OUTPUT = 10
N_LIVE = 11

# Reasons, as in estimator.identification.online.recursive.Reason.
NONE, TOO_FEW_SAMPLES, NOT_EXCITED, UNSTABLE, CONSTANT_OUTPUT = range(5)

VERSION = 2  # goes up when a part changes its meaning; states of another version are refused


class Memory:
    """A record of numbers and its parts."""

    def __init__(self, kept: Shapes, settings: Mapping[str, FloatArray], room: Shapes | None = None) -> None:
        shapes = {**kept, **{name: numbers.shape for name, numbers in settings.items()}, **(room or {})}
        self.record = np.zeros(1, dtype=[(name, np.float64, shape) for name, shape in shapes.items()])
        self._kept, self._settings = tuple(kept), tuple(settings)
        for name, numbers in settings.items():
            self[name][...] = numbers

    def __getitem__(self, name: str) -> FloatArray:
        """Return a part: a view, to be read or written."""
        return self.record[name][0]

    @property
    def settings(self) -> dict[str, FloatArray]:
        """What was set up and does not change, by name."""
        return {name: self[name].copy() for name in self._settings}

    @property
    def snapshot(self) -> dict[str, FloatArray]:
        """Copies of what the next sample needs, by name."""
        return {name: self[name].copy() for name in self._kept}


SavedState = dict[str, Any]


def saved(estimator: str, memory: Memory) -> SavedState:
    """Return the state of an estimator: its name, what it was set up with, and what it has learnt."""
    return {"estimator": estimator, "version": VERSION, **memory.settings, **memory.snapshot}


def restored(state: Mapping[str, Any], estimator: str, memory: Memory) -> None:
    """Put a kept state back into a memory; BadSetting if it is another estimator's, version's or setup's."""
    for name, expected in (("estimator", estimator), ("version", VERSION)):
        _require(str(np.asarray(_part(state, name))) == str(expected), name, state[name], repr(expected))
    for name, setting in memory.settings.items():
        _require(
            np.array_equal(_numbers(state, name), setting), name, state[name], f"{setting.tolist()}, as set up here"
        )
    new = {name: _numbers(state, name) for name in memory.snapshot}
    for name, values in new.items():
        _require(values.shape == memory[name].shape, name, f"of shape {values.shape}", f"shape {memory[name].shape}")
        _require(bool(np.isfinite(values).all()), name, "not finite", "finite numbers only")
    for name, values in new.items():
        memory[name][...] = values


def _part(state: Mapping[str, Any], name: str) -> Any:
    _require(name in state, name, "missing", "a part of every state")
    return state[name]


def _numbers(state: Mapping[str, Any], name: str) -> np.ndarray:
    part = _part(state, name)
    try:
        return np.asarray(part, dtype=np.float64)
    except (TypeError, ValueError) as fault:
        raise BadSetting(f"state of an estimator: {name} holds {part!r}, expected numbers only.") from fault


def _require(fits: bool, name: str, got: Any, expected: str) -> None:
    if not fits:
        raise BadSetting(
            f"state of an estimator: {name} is {got}, expected {expected}. Restore it into an estimator of the same "
            "kind and settings as the one that was saved."
        )


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
    e_prior: float  # y - y_hat before theta took the sample [output unit]
    e_post: float  # y - y_hat after it [output unit]

    @property
    def status(self) -> Status:
        """Whether the estimate may be used."""
        return self.reason.status


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Every estimate of a block."""

    theta: FloatArray  # (N, na+nb)
    y_hat: FloatArray  # (N,)
    e_prior: FloatArray  # (N,)
    e_post: FloatArray  # (N,)
    used: BoolArray  # (N,)
    reason: ReasonArray  # (N,): values of :class:`Reason`
    extra: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))  # (N, m)
    extra_names: tuple[str, ...] = ()  # names of its columns

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


_REASONS = tuple(Reason)


Block = Callable[..., None]
"""A compiled loop: ``block(u, y, okay, memory, out)``, one row of ``out`` (:func:`row_type`) for each sample."""


def row_type(n_parameters: int, n_extra: int) -> np.dtype[np.void]:
    """Return the type of a row of results: :class:`Estimate` as the compiled loops write it."""
    numbers = [(name, np.float64) for name in ("y_hat", "e_prior", "e_post")]
    vectors = [("theta", np.float64, (n_parameters,)), ("extra", np.float64, (n_extra,))]
    return np.dtype([*vectors, *numbers, ("used", np.bool_), ("reason", np.int8)], align=True)


class RecursiveEstimator:
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

        Cost and memory do not depend on the samples before. Never raises on a value.
        """
        self._u[0], self._y[0], self._okay[0] = u, y, okay
        self._advance(self._u, self._y, self._okay, self._row)
        reason, *rest = self._row_rest.item()
        return Estimate(self._row_theta.copy(), _REASONS[reason], *rest)

    def run(self, u: FloatArray, y: FloatArray, okay: BoolArray) -> Trajectory:
        """Take a block of samples, with the same bits as one by one."""
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

    def state(self) -> SavedState:
        """Return everything it remembers, as plain arrays; how they are kept is at the head of this file."""
        return saved(self._name, self._memory)

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up a saved state: what follows has the bits it would have had without the break."""
        restored(state, self._name, self._memory)
