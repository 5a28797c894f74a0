"""Extended Kalman filter (EKF) with the physical two-mass parameters among its states.

L. Ljung, Asymptotic Behavior of the Extended Kalman Filter as a Parameter Estimator for Linear Systems, IEEE Trans.
Automatic Control 24 (1979); B. D. O. Anderson and J. B. Moore, Optimal Filtering (Prentice Hall, 1979), chapter 8.
State x = [w_M, w_L, s, T_0, ln J_M, ln J_L, ln k, ln c] with the equations of motion of
the two masses below::

    K(t)      = P(t) H^T / (H P(t) H^T + R),       H = [1 0 .. 0]
    x(t|t)    = x(t) + K(t) (y(t) - w_M(t)),       P(t|t) = P(t) - K(t) H P(t)
    x(t+1)    = f(x(t|t), u(t+1-nk)),              P(t+1) = Phi P(t|t) Phi^T + Q,      Phi = df/dx

Logarithms, so that no inertia, stiffness or damping can turn negative. T_0 is a load torque that wanders: a hill, the
driver, and near a constant speed the viscous frictions, which are therefore given and not estimated. P is kept as
U D U^T: G. J. Bierman, Factorization Methods for Discrete Sequential Estimation (Academic Press, 1977), chapters V
(correction) and VI (prediction, Thornton's).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, inlined
from estimator.identification.linear_model import Orders
from estimator.identification.online.adaptation import absorb, diagonal
from estimator.identification.online.recursive import (
    N_LIVE,
    NONE,
    NOT_EXCITED,
    TOO_FEW_SAMPLES,
    USED,
    Memory,
    Parts,
    RecursiveEstimator,
    Shapes,
)
from estimator.identification.online.regression import (
    LARGEST,
    LEARNT,
    SETTLING,
    constant_signal,
    note_output,
    note_torque,
    push,
)
from estimator.signals.record import BoolArray, FloatArray
from estimator.signals.settings import Requirement, is_positive, require

ESTIMATED = ("J_M", "J_L", "k", "c")
"""What the filter estimates; the frictions are given, since near a constant speed they are part of the load torque."""

# Columns that are propagated: the motion, then its derivatives.
MOTION = 0
BY_STATE = 1  # three columns: by w_M, w_L, s
BY_LOAD = 4
BY_LOG = 5  # four columns: by ln J_M, ln J_L, ln k, ln c
BY_TORQUE = 9
N_COLUMNS = 10

TERMS = 16  # 1 / 16! = 5e-14 of a part of the period whose largest rate times length is 1
MOST_PARTS = 128

N_STATES = 8  # w_M, w_L, s, T_0, ln J_M, ln J_L, ln k, ln c
N_MOTION = 4
FIRST_LOG = 4

# Places in `law`: numbers, then three rows of N_STATES.
PERIOD, VARIANCE = 0, 1
NOISE = 2  # variance each state gains per sample
START = NOISE + N_STATES  # variance of each state before the first sample
ORIGIN = START + N_STATES  # value of each state before the first sample

# Places in `live` besides those of all estimators, where theirs have the gain.
STARTED = 0  # 1 once an output has set the speeds
REJECTED = 1  # outputs in a row that the prediction makes impossible

GATE = 100.0  # standard deviations beyond which an output is no measurement
PATIENCE = 20.0  # such outputs in a row after which it is the motion that is wrong
LARGEST_TORQUE = 1e12  # beyond it a torque is no measurement; below it nothing here can overflow
WIDEST = 4.6  # ln 100: how far a parameter may go from where it started

WIDTH = 2 * N_STATES  # W = [Phi U, I]


@dataclass(frozen=True, slots=True)
class TwoMass:
    """Parameters reflected to the motor shaft."""

    J_M: float  # inertia of motor and load [kg m^2]
    J_L: float  # of the load
    k: float  # stiffness [Nm/rad] and damping [Nm s/rad] of the shaft
    c: float  # damping
    b_M: float = 0.0  # viscous friction at motor and load [Nm s/rad]
    b_L: float = 0.0  # at the load

    def __post_init__(self) -> None:
        rows = [
            Requirement(name, getattr(self, name), is_positive(getattr(self, name)), "above 0") for name in ESTIMATED
        ]
        frictions = [("b_M", self.b_M), ("b_L", self.b_L)]
        rows += [Requirement(name, value, 0 <= value < float("inf"), "0 or above") for name, value in frictions]
        require("two-mass model", rows)


@dataclass(frozen=True, slots=True)
class EkfNoise:
    """Standard deviations; the defaults are those of a bus on an ordinary road, about twice what its sensors have.

    Twice, since what wrong start values do to the linearisation counts as noise too. With the sensors' own 0.05 rad/s
    and 1 Nm, and starts 30 to 70 % off, one or two of twelve simulated cruises of 30 s ended with a load inertia twice
    to a hundred times too large, and believed it.
    """

    output_rad_s: float = 0.1  # noise of a speed reading [rad/s]
    torque_nm: float = 10.0  # noise of a torque reading [Nm]
    load_nm_per_sqrt_s: float = 10.0  # how far the load torque wanders in a second [Nm]
    log_per_sqrt_s: float = 1e-4  # how far a parameter wanders in a second, relative to itself
    start_log: float = 0.7  # how far a start value may be off, relative to itself
    start_speed_rad_s: float = 1.0  # the same of the motion
    start_twist_rad: float = 0.2  # ... of the twist [rad]
    start_load_nm: float = 1000.0  # ... of the load torque [Nm]

    def __post_init__(self) -> None:
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        require("ekf noise", [Requirement(name, v, is_positive(v), "above 0") for name, v in values.items()])

    def law(self, start: TwoMass, period_s: float) -> FloatArray:
        """Return the settings in their order in the loop: period, R, diag Q, diag P(0), x(0); shape (26,)."""
        speed = (period_s * self.torque_nm / start.J_M) ** 2
        load = period_s * self.load_nm_per_sqrt_s**2
        # T_0 wandering within the period has moved w_L by its integral: the variance of a random walk's integral.
        load_speed = load * (period_s / start.J_L) ** 2 / 3.0
        walk = period_s * self.log_per_sqrt_s**2
        noise = [speed, load_speed, 0.0, load, walk, walk, walk, walk]
        motion = [self.start_speed_rad_s**2, self.start_speed_rad_s**2, self.start_twist_rad**2, self.start_load_nm**2]
        origin = [0.0, 0.0, 0.0, 0.0, *np.log([start.J_M, start.J_L, start.k, start.c])]
        return np.array([period_s, self.output_rad_s**2, *noise, *motion, *[self.start_log**2] * 4, *origin])


@inlined
def rate(x: FloatArray, column: int, forced: float, load: float, p: FloatArray, out: FloatArray) -> None:
    """Set a column of ``out`` to the time derivative of one of ``x`` under a torque and a load; p as in the filter."""
    J_M, J_L, k, c, b_M, b_L = p[0], p[1], p[2], p[3], p[4], p[5]
    slip = x[0, column] - x[1, column]
    shaft = c * slip + k * x[2, column]
    out[0, column] = (forced - shaft - b_M * x[0, column]) / J_M
    out[1, column] = (shaft - b_L * x[1, column] - load) / J_L
    out[2, column] = slip


@inlined
def rates(x: FloatArray, torque: float, load: float, unit: float, p: FloatArray, out: FloatArray) -> None:
    """Differentiate all columns; ``unit`` is 1 where the inputs act (first derivative) and 0 above it."""
    rate(x, MOTION, torque * unit, load * unit, p, out)
    for column in range(BY_STATE, BY_LOAD):
        rate(x, column, 0.0, 0.0, p, out)
    rate(x, BY_LOAD, 0.0, unit, p, out)
    for column in range(BY_LOG, BY_TORQUE):
        rate(x, column, 0.0, 0.0, p, out)
    rate(x, BY_TORQUE, unit, 0.0, p, out)
    out[0, BY_LOG] -= out[0, MOTION]
    out[1, BY_LOG + 1] -= out[1, MOTION]
    spring, damper = p[2] * x[2, MOTION], p[3] * (x[0, MOTION] - x[1, MOTION])
    out[0, BY_LOG + 2] -= spring / p[0]
    out[1, BY_LOG + 2] += spring / p[1]
    out[0, BY_LOG + 3] -= damper / p[0]
    out[1, BY_LOG + 3] += damper / p[1]


@inlined
def parts_of(period_s: float, p: FloatArray) -> int:
    """Return how many parts to cut a period into, so that the series of each converges at once."""
    fastest = (p[2] * (1.0 / p[0] + 1.0 / p[1])) ** 0.5 + (p[3] + p[4]) / p[0] + (p[3] + p[5]) / p[1]
    return int(min(1.0 + period_s * fastest, float(MOST_PARTS)))


@inlined
def propagate(
    x: FloatArray,
    torque: float,
    load: float,
    period_s: float,
    p: FloatArray,
    term: FloatArray,
    following: FloatArray,
) -> None:
    """Move ``x``, shape (3, N_COLUMNS), on by one period; the derivatives are set up here.

    ``p`` holds J_M, J_L, k, c, b_M, b_L; ``term`` and ``following`` are room of the shape of x.
    """
    for row in range(3):
        for column in range(1, N_COLUMNS):
            x[row, column] = 1.0 if column == BY_STATE + row else 0.0
    parts = parts_of(period_s, p)
    length_s = period_s / parts
    for _ in range(parts):
        for row in range(3):
            for column in range(N_COLUMNS):
                term[row, column] = x[row, column]
        for order in range(1, TERMS + 1):
            rates(term, torque, load, 1.0 if order == 1 else 0.0, p, following)
            weight = length_s / order
            for row in range(3):
                for column in range(N_COLUMNS):
                    term[row, column] = weight * following[row, column]
                    x[row, column] += term[row, column]


@inlined
def transfer_function(x: FloatArray, theta: FloatArray) -> None:
    """Set theta = a_1 .. a_3, b_1 .. b_3 of speed over torque from the propagated columns (Leverrier, Markov)."""
    a00, a01, a02 = x[0, 1], x[0, 2], x[0, 3]
    a10, a11, a12 = x[1, 1], x[1, 2], x[1, 3]
    a20, a21, a22 = x[2, 1], x[2, 2], x[2, 3]
    b0, b1, b2 = x[0, BY_TORQUE], x[1, BY_TORQUE], x[2, BY_TORQUE]
    c0, c1, c2 = a00 * b0 + a01 * b1 + a02 * b2, a10 * b0 + a11 * b1 + a12 * b2, a20 * b0 + a21 * b1 + a22 * b2
    minors = a00 * a11 - a01 * a10 + a00 * a22 - a02 * a20 + a11 * a22 - a12 * a21
    determinant = a00 * (a11 * a22 - a12 * a21) - a01 * (a10 * a22 - a12 * a20) + a02 * (a10 * a21 - a11 * a20)
    theta[0] = -(a00 + a11 + a22)
    theta[1] = minors
    theta[2] = -determinant
    theta[3] = b0
    theta[4] = c0 + theta[0] * b0
    theta[5] = a00 * c0 + a01 * c1 + a02 * c2 + theta[0] * c0 + theta[1] * b0


def memory_parts(of: Orders) -> Shapes:
    """Return the parts the filter keeps; ``inputs`` are the torques on their way, newest first."""
    vectors = dict.fromkeys(("x", "D", "diagonal"), (N_STATES,))
    own = {"theta": (of.n_parameters,), "physical": (6,), "inputs": (of.nk,), "U": (N_STATES, N_STATES)}
    return {"live": (N_LIVE,), **vectors, **own}


def room() -> Shapes:
    """Return the parts it works in: W, its weights, a row of it; three times the motion's columns; three vectors."""
    columns = dict.fromkeys(("columns", "term", "following"), (3, N_COLUMNS))
    vectors = dict.fromkeys(("H", "g", "f"), (N_STATES,))
    return {"W": (N_STATES, WIDTH), "weights": (WIDTH,), "row": (WIDTH,), **columns, **vectors}


@inlined
def begin(y: float, m: Parts) -> None:
    """Set both speeds to an output, and forget how motion and parameters go together."""
    for i in range(N_STATES):
        if i < N_MOTION:
            m.x[i] = y if i < 2 else m.law[ORIGIN + i]
        m.D[i] = m.law[START + i]
        for j in range(N_STATES):
            m.U[i, j] = 1.0 if i == j else 0.0
    m.live[STARTED] = 1.0
    m.live[REJECTED] = 0.0


@inlined
def orthogonalise(W: FloatArray, weights: FloatArray, row: FloatArray, U: FloatArray, D: FloatArray) -> None:
    """Factor W diag(weights) W^T into U D U^T (Thornton's modified weighted Gram-Schmidt)."""
    for j in range(N_STATES - 1, -1, -1):
        total = 0.0
        for m in range(WIDTH):
            row[m] = weights[m] * W[j, m]
            total += row[m] * W[j, m]
        D[j] = total
        for i in range(N_STATES):
            U[j, i] = 1.0 if i == j else 0.0
        for i in range(j):
            product = 0.0
            for m in range(WIDTH):
                product += W[i, m] * row[m]
            share = product / total if total > 0.0 else 0.0
            U[j, i] = share
            for m in range(WIDTH):
                W[i, m] -= share * W[j, m]


@inlined
def spread(m: Parts) -> None:
    """Move the covariance on by one period: Phi P Phi^T + Q."""
    W, U, columns, law = m.W, m.U, m.columns, m.law
    for j in range(N_STATES):  # column j of Phi U, with Phi the unit matrix below its first three rows
        for i in range(N_STATES):
            W[i, j] = U[j, i]
        for i in range(3):
            value = 0.0
            for k in range(3):
                value += columns[i, 1 + k] * U[j, k]
            value += columns[i, BY_LOAD] * U[j, 3]
            for k in range(FIRST_LOG, N_STATES):
                value += columns[i, BY_LOG + k - FIRST_LOG] * U[j, k]
            W[i, j] = value
        m.weights[j] = m.D[j]
    for i in range(N_STATES):
        for j in range(N_STATES):
            W[i, N_STATES + j] = 1.0 if i == j else 0.0
        grows = i < N_MOTION or m.diagonal[i] < law[START + i]  # without excitation a parameter is forgotten, once
        m.weights[N_STATES + i] = law[NOISE + i] if grows else 0.0
    orthogonalise(W, m.weights, m.row, U, m.D)


@inlined
def observed(y: float, m: Parts) -> bool:
    """Correct the state by an output; tell whether it was possible besides the prediction."""
    x, law, live = m.x, m.law, m.live
    variance = 0.0
    for j in range(N_STATES):
        variance += m.U[j, 0] * m.U[j, 0] * m.D[j]
    error = y - x[0]
    if not error * error <= GATE * GATE * (variance + law[VARIANCE]):
        live[REJECTED] += 1.0
        if live[REJECTED] >= PATIENCE:
            begin(y, m)
        return False
    live[REJECTED] = 0.0
    for i in range(N_STATES):
        m.H[i] = 1.0 if i == 0 else 0.0
    s = absorb(m.H, law[VARIANCE], m.U, m.D, m.g, m.f)
    for i in range(N_STATES):
        x[i] += m.g[i] * error / (law[VARIANCE] + s)
    for i in range(FIRST_LOG, N_STATES):
        x[i] = min(max(x[i], law[ORIGIN + i] - WIDEST), law[ORIGIN + i] + WIDEST)
    return True


@inlined
def judged(m: Parts) -> int:
    """Return the reason of the estimate's status."""
    if m.live[USED] < SETTLING * N_STATES:
        return TOO_FEW_SAMPLES
    constant = constant_signal(m.live)
    if constant != NONE:
        return constant
    for i in range(FIRST_LOG, N_STATES):
        if not m.diagonal[i] < LEARNT * m.law[START + i]:
            return NOT_EXCITED
    return NONE


@inlined
def take_torque(u: float, live: FloatArray, inputs: FloatArray) -> None:
    """Push the torque; the last one is held in place of one that can't be used."""
    if abs(u) <= LARGEST_TORQUE:
        note_torque(u, inputs[0], live)
        push(inputs, u)
    else:
        push(inputs, inputs[0])


@inlined
def predict(m: Parts) -> None:
    """Move the state on by one period, and read the transfer function off its derivatives."""
    x, columns = m.x, m.columns
    for i in range(3):
        columns[i, 0] = x[i]
    torque = m.inputs[m.inputs.shape[0] - 1]
    propagate(columns, torque, x[3], m.law[PERIOD], m.physical, m.term, m.following)
    for i in range(3):
        x[i] = columns[i, 0]
    transfer_function(columns, m.theta)


@inlined
def step(u: float, y: float, okay: bool, m: Parts, row: Parts) -> None:
    """Run one sample through correction and prediction."""
    live, x = m.live, m.x
    take_torque(u, live, m.inputs)
    measured = okay and abs(y) <= LARGEST
    if measured and live[STARTED] == 0.0:
        begin(y, m)
    predicted = x[0]
    used = measured and observed(y, m)
    if used:
        note_output(y, live)
    row.y_hat = x[0]
    row.e_prior = y - predicted if used else 0.0
    row.e_post = y - x[0] if used else 0.0
    row.used = used
    for i in range(FIRST_LOG):
        m.physical[i] = np.exp(x[FIRST_LOG + i])
        row.extra[i] = m.physical[i]
    predict(m)
    diagonal(m.U, m.D, m.diagonal)
    row.reason = judged(m)
    if live[STARTED] == 1.0:
        spread(m)
    for i in range(m.theta.shape[0]):
        row.theta[i] = m.theta[i]


@compiled
def block(u: FloatArray, y: FloatArray, okay: BoolArray, memory: NDArray[np.void], out: NDArray[np.void]) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    for t in range(u.shape[0]):
        step(u[t], y[t], okay[t], memory[0], out[t])


class Ekf(RecursiveEstimator):
    """The filter with its state; ``y_hat`` is the filtered motor speed."""

    def __init__(self, start: TwoMass, sample_time_s: float, nk: int = 1, noise: EkfNoise | None = None) -> None:
        require(
            "ekf",
            (
                Requirement("sample_time_s", sample_time_s, is_positive(sample_time_s), "a period above 0 s"),
                Requirement("nk", nk, nk >= 1, "1 or more: a held torque moves the next sample first"),
            ),
        )
        noise = EkfNoise() if noise is None else noise
        orders = Orders(3, 3, nk)
        n = N_STATES
        law = noise.law(start, sample_time_s)
        structure = np.array([orders.na, orders.nb, nk], dtype=np.float64)
        memory = Memory(memory_parts(orders), {"structure": structure, "law": law}, room())
        memory["x"][:] = law[ORIGIN:]
        memory["U"][...] = np.eye(n)
        memory["D"][:] = memory["diagonal"][:] = law[START:ORIGIN]
        memory["physical"][:] = [start.J_M, start.J_L, start.k, start.c, start.b_M, start.b_L]
        super().__init__("ekf", block, orders, memory, ESTIMATED)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the physical parameters the samples so far do not determine."""
        if self._stands_still:
            return ESTIMATED
        now, start = self._memory["diagonal"][FIRST_LOG:], self._memory["law"][START:ORIGIN]
        still = now >= LEARNT * start[FIRST_LOG:]
        return tuple(name for name, is_open in zip(ESTIMATED, still, strict=True) if is_open)

    @property
    def physical(self) -> TwoMass:
        """Present parameters."""
        return TwoMass(*self._memory["physical"].tolist())

    @property
    def covariance(self) -> FloatArray:
        """Covariance of ln J_M, ln J_L, ln k, ln c as the filter believes it, shape (4, 4): relative variances."""
        U = self._memory["U"].T
        whole = (U * self._memory["D"]) @ U.T
        return np.asarray(whole[FIRST_LOG:, FIRST_LOG:], dtype=np.float64)
