"""The resonance of every estimate, and how sure it is: standard deviations while driving.

For any recursive estimator of an output-error model. With theta* for the truth and w for the noise in the output,
the prediction error is, to first order, ``e0(t) = w(t) - psi(t-1)^T (theta(t-1) - theta*)``, psi the gradient of the
prediction. Whatever its adaptation law, the estimator corrects by ``theta(t) - theta(t-1) = K(t) e0(t)``. So the
covariance of its error is::

    P(t) = (I - K psi^T) P(t-1) (I - K psi^T)^T + S K K^T

and K is *seen*, not assumed: it is the correction made, divided by the error it was made for.

**The noise S.** The residual is coloured (road, aliasing, what the model lacks), and what counts is its density where
psi has its own: at the resonance. Hence S is the residual's density there, found by passing it twice through the
resonance's own pole, which weighs it as psi^2 does, and relating the mean square to what a white residual would give
(L. Ljung, System Identification, 2nd ed. 1999, (9.54): the covariance of the estimate with the noise spectrum under
the integral). The mean runs over the last :data:`MEMORY` samples.

**Excitation.** At the end of every block, what the torque makes of the output at the resonance is held against the
density S of the residual there. *Excited* is a block in which it is the larger; to become so, and to stay so with a
torque that has become much weaker, it takes :data:`OPENS` times as much: a torque that is nothing but the noise of its
reading makes an output that is not there, and a single look at a narrow band of noise exceeds ln(1000) times its mean
once in 1000. *Lacking*: the torque's steps have less than 1 / :data:`OPENS` of the power they had while excited (the
PRBS is off); the estimator is held, for it would learn noise, and forget. *Drowned*, which two blocks in a row have to
say: the noise is above what the model makes of the torque; what has been learnt is begun anew. An estimate that is held
keeps its covariance, but the samples within :data:`MEMORY` say less and less: by what is left of their information the
variances are divided, up to those of a value that may be anywhere in the band in which the resonance is looked for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from estimator.compiled import compiled
from estimator.identification.linear_model import ComplexArray, Orders
from estimator.identification.modes.modes import LIGHTLY_DAMPED
from estimator.identification.online.recursive import Trajectory
from estimator.identification.tracking.poles import (
    DAMPING,
    FREQUENCY_HZ,
    HEIGHT,
    LAST,
    N_THROUGH,
    dominant,
    mode_gradient,
    output_density,
    pass_torque,
    residue,
    sensitivity,
    squared,
    weight_of,
)
from estimator.signals.record import BoolArray, FloatArray, IntArray

OPENS = math.log(1000.0)
"""Density of the torque's output over that of the residual from which on it is excitation, see above."""

CLOSES = 1.0
"""The same, below which it is none any more: the torque moves the output less than everything else does."""


# Verdicts, as in estimator.identification.tracking.follow.Excitation.
_, EXCITED, LACKING, DROWNED = 0, 1, 2, 3

# Places in `mode`: the resonance that was known last.
MODE_HZ = 0  # 0 before there was one
MODE_DAMPING, POLE_RE, POLE_IM, RHO_RE, RHO_IM = 1, 2, 3, 4, 5
N_MODE = 6

# Places in `block`: sums over the present block.
SAMPLES = 0
GOOD = 1  # samples that were good, with a mode
OUTPUT = 2  # over them: density of the torque's output at the peak, over that of the noise
TORQUE = 3  # square of the torque's step
N_BLOCK = 4

# Places in `lasting`: what outlasts a block.
VERDICT = 0
WEAK = 1  # 1 if the last block was below what is excitation
WITHIN = 2  # mean of TORQUE over the memory
USUAL = 3  # mean of TORQUE while excited; 0 before it ever was
IN_A_ROW = 4  # excited blocks without another in between
N_LASTING = 5

# Rows of `past`: newest value first.
Y_HAT = 0
Y_HAT_F = 1  # filtered by the resonance's pair of poles
INPUT = 2
INPUT_F = 3

# Places in `structure`.
NA, NB, NK = 0, 1, 2

# Places in `heard`: the residual as the resonance hears it.
ONCE_RE, ONCE_IM, TWICE_RE, TWICE_IM = 0, 1, 2, 3  # filtered by the pole, and once more
DENSITY = 4  # its density there, as the variance of a white residual [output unit squared]
COUNT = 5  # samples heard so far

# Places in `pair`: 1 + l_1 q^-1 + l_2 q^-2 of the resonance's poles, and what the others amplify there.
L_1, L_2, OTHERS = 0, 1, 2

LEAST_DISTANCE = 0.1  # of the other poles: one that passes by the resonance, while the estimate moves, is no gain

# Places in `numbers`.
SAMPLE_TIME_S, LOWEST_HZ, HIGHEST_HZ, LARGEST_DAMPING, AT_MEMORY, AT_FEWEST, BLOCK, AT_OPENS, AT_CLOSES = range(9)

# Columns of `out`: those of a mode, then
FREQUENCY_STD_HZ, DAMPING_STD = 3, 4

UNIFORM = 12.0**-0.5  # standard deviation of a value that may lie anywhere in a range of 1

USABLE = 0  # estimator.identification.online.recursive.Reason.NONE

MEMORY = 500
"""Kept samples over which the residual's density is averaged: 10 s at 20 ms, some thirty times the memory of a mode at
8 Hz and a damping of 0.06, so that S is known within a fifth."""

TRUSTED = 26
"""Excited blocks in a row after which an estimate that had to begin anew counts as settled: as many as the watch takes
to know what is usual."""

SAMPLES_BEFORE_STD = 240  # samples of a usable estimate before a standard deviation is given


class Excitation(IntEnum):
    """Verdict on a block; the numbers are those of the compiled loop."""

    UNKNOWN = 0  # no resonance has been known yet
    EXCITED = 1
    LACKING = 2  # the torque has lost its power
    DROWNED = 3  # the noise is above what the model makes of the torque


@compiled
def keep_mode(frequency_hz: float, damping: float, pole: complex, rho: complex, mode: FloatArray) -> None:
    """Keep a resonance that is known; the one before stays where the present estimate has none."""
    mode[MODE_HZ], mode[MODE_DAMPING] = frequency_hz, damping
    mode[POLE_RE], mode[POLE_IM], mode[RHO_RE], mode[RHO_IM] = pole.real, pole.imag, rho.real, rho.imag


@compiled
def take_torque(
    u: float, okay: bool, density: float, sample_time_s: float, mode: FloatArray, through: FloatArray, block: FloatArray
) -> None:
    """Add a sample's torque, as the resonance weighs it, to the sums of the present block."""
    pole = complex(mode[POLE_RE], mode[POLE_IM])
    block[SAMPLES] += 1.0
    if okay and mode[MODE_HZ] > 0.0:
        weight = weight_of(pole, complex(mode[RHO_RE], mode[RHO_IM]), mode[MODE_DAMPING], sample_time_s)
        psi = sensitivity(weight, through)
        block[GOOD] += 1.0
        block[OUTPUT] += output_density(psi, pole, mode[MODE_HZ] * mode[MODE_DAMPING]) / density
        step = u - through[LAST]
        block[TORQUE] += step * step
    pass_torque(u, pole, through)


@compiled
def judge(memory: float, opens: float, closes: float, block: FloatArray, lasting: FloatArray) -> int:
    """Return the verdict on the excitation at the end of a block: EXCITED, LACKING or weak, with hysteresis."""
    ratio, torque = block[OUTPUT] / block[GOOD], block[TORQUE] / block[GOOD]
    take_mean(torque, block[SAMPLES] / memory, WITHIN, lasting)
    was_excited, was_weak = lasting[VERDICT] == EXCITED, lasting[WEAK] == 1.0
    if ratio < opens and opens * torque < lasting[USUAL]:
        return LACKING
    weak = ratio < (closes if was_excited else opens)
    lasting[WEAK] = 1.0 if weak else 0.0
    if weak and not (was_excited and not was_weak):
        return DROWNED
    take_mean(torque, block[SAMPLES] / memory, USUAL, lasting)
    return EXCITED


@compiled
def take_mean(value: float, share: float, place: int, lasting: FloatArray) -> None:
    """Take a value into a mean with an exponential memory; the first is the mean."""
    if lasting[place] == 0.0:
        lasting[place] = value
    lasting[place] += share * (value - lasting[place])


@compiled
def end_block(memory: float, opens: float, closes: float, block: FloatArray, lasting: FloatArray) -> None:
    """Judge a whole block and begin the next; with few good samples, or no mode yet, the verdict stays as it is."""
    if 2.0 * block[GOOD] >= block[SAMPLES]:
        lasting[VERDICT] = judge(memory, opens, closes, block, lasting)
    lasting[IN_A_ROW] = lasting[IN_A_ROW] + 1.0 if lasting[VERDICT] == EXCITED else 0.0
    block[:] = 0.0


@compiled
def forgotten(lasting: FloatArray) -> float:
    """Return how many times more the torque said while excited than within the memory; 1 at least."""
    if lasting[USUAL] <= lasting[WITHIN]:
        return 1.0
    return float(lasting[USUAL] / lasting[WITHIN])


@compiled
def shift_in(row: FloatArray, value: float) -> None:
    """Put a value in front; the oldest drops out."""
    for i in range(row.shape[0] - 1, 0, -1):
        row[i] = row[i - 1]
    row[0] = value


@compiled
def through_pair(value: float, pair: FloatArray, row: FloatArray) -> float:
    """Return the next output of the pair's 1 / (1 + l_1 q^-1 + l_2 q^-2), given its last ones in row."""
    return float(value - pair[L_1] * row[0] - pair[L_2] * row[1])


@compiled
def take_pair(roots: ComplexArray, found: int, pair: FloatArray) -> None:
    """Take the resonance's poles into the gradient's filter; an unstable pair leaves the last one in place."""
    pole = roots[found]
    magnitude = np.sqrt(squared(pole))
    if not magnitude < 1.0:
        return
    pair[L_1], pair[L_2] = -2.0 * pole.real, magnitude * magnitude
    others = 1.0 + 0.0j
    for i in range(roots.shape[0]):
        if i != found and squared(roots[i] - pole.conjugate()) > 1e-18:
            others *= 1.0 - roots[i] * (pole.conjugate() * (1.0 / magnitude))
    pair[OTHERS] = 1.0 / max(np.sqrt(squared(others)), LEAST_DISTANCE)


@compiled
def fill_gradient(structure: IntArray, gain: float, outputs: FloatArray, inputs: FloatArray, psi: FloatArray) -> None:
    """Set psi(t-1) = gain [-yhat(t-1) .. , u(t-nk) ..] from rows that hold them, the input's with u(t) in front."""
    na = structure[NA]
    for i in range(na):
        psi[i] = -gain * outputs[i]
    for j in range(structure[NB]):
        psi[na + j] = gain * inputs[structure[NK] + j]


@compiled
def spread(P: FloatArray, psi: FloatArray, K: FloatArray, density: float, v: FloatArray) -> None:
    """Bring the covariance of theta (n, n) forward by one sample with gain K and noise of this density."""
    n = psi.shape[0]
    c = density
    reach = 0.0
    for i in range(n):
        reach += K[i] * psi[i]
    if abs(reach) > 1.0:  # no correction takes back more than the error it was made for
        for i in range(n):
            psi[i] /= abs(reach)
    for i in range(n):
        v[i] = 0.0
        for j in range(n):
            v[i] += P[i, j] * psi[j]
    for i in range(n):
        c += psi[i] * v[i]
    for i in range(n):
        for j in range(i + 1):
            P[i, j] += c * K[i] * K[j] - v[i] * K[j] - K[i] * v[j]
            P[j, i] = P[i, j]


@compiled
def hear(e: float, pole: complex, memory: float, heard: FloatArray) -> None:
    """Take a residual into its density at the resonance: passed twice through 1 / (1 - pole q^-1)."""
    once = pole * complex(heard[ONCE_RE], heard[ONCE_IM]) + e
    twice = pole * complex(heard[TWICE_RE], heard[TWICE_IM]) + once
    heard[ONCE_RE], heard[ONCE_IM], heard[TWICE_RE], heard[TWICE_IM] = once.real, once.imag, twice.real, twice.imag
    r2 = squared(pole)
    rest = 1.0 - r2
    white = (1.0 + r2) / (
        rest * rest * rest
    )  # sum over k of (k + 1)^2 r^(2 k): what a white residual of variance 1 gives
    heard[COUNT] += 1.0
    heard[DENSITY] += (squared(twice) / white - heard[DENSITY]) / min(heard[COUNT], memory)


@compiled
def form(P: FloatArray, gradient: FloatArray) -> float:
    """Return the standard deviation of a quantity with that gradient over the first parameters."""
    total = 0.0
    for i in range(gradient.shape[0]):
        for j in range(gradient.shape[0]):
            total += gradient[i] * P[i, j] * gradient[j]
    return np.sqrt(total) if total > 0.0 else np.nan


@compiled
def follow_correction(
    structure: IntArray,
    pair: FloatArray,
    past: FloatArray,
    heard: FloatArray,
    e: float,
    step: FloatArray,
    P: FloatArray,
    work: FloatArray,
) -> None:
    """Follow the correction ``step`` of theta that was made for a prediction error e into P."""
    n = step.shape[0]
    psi, K, v = work[0, :n], work[1, :n], work[2, :n]
    if heard[COUNT] > 0.0:
        fill_gradient(structure, pair[OTHERS], past[Y_HAT_F], past[INPUT_F], psi)
    else:
        fill_gradient(structure, 1.0, past[Y_HAT], past[INPUT], psi)
    for i in range(n):
        K[i] = step[i] / e
    spread(P, psi, K, heard[DENSITY], v)


@compiled
def deviations(
    numbers: FloatArray,
    roots: ComplexArray,
    found: int,
    P: FloatArray,
    lasting: FloatArray,
    frequency: FloatArray,
    damping: FloatArray,
    out: FloatArray,
) -> None:
    """Fill the standard deviations of a resonance, no larger than those of a value that may be anywhere."""
    mode_gradient(roots, found, numbers[SAMPLE_TIME_S], frequency, damping)
    wider, widest_hz = np.sqrt(forgotten(lasting)), UNIFORM * (numbers[HIGHEST_HZ] - numbers[LOWEST_HZ])
    out[FREQUENCY_STD_HZ] = min(wider * form(P, frequency), widest_hz)
    out[DAMPING_STD] = min(wider * form(P, damping), UNIFORM * numbers[LARGEST_DAMPING])


@compiled
def follow_block(
    u: FloatArray,
    okay: BoolArray,
    theta: FloatArray,
    y_hat: FloatArray,
    e_prior: FloatArray,
    used: BoolArray,
    reason: np.ndarray,
    structure: IntArray,
    numbers: FloatArray,
    before: FloatArray,
    pair: FloatArray,
    P: FloatArray,
    past: FloatArray,
    heard: FloatArray,
    last_mode: FloatArray,
    through: FloatArray,
    block: FloatArray,
    lasting: FloatArray,
    work: FloatArray,
    roots: ComplexArray,
    out: FloatArray,
) -> None:
    """Follow the resonance of every estimate of a block, with its standard deviation and the excitation's verdict."""
    na, n = structure[NA], theta.shape[1]
    step, frequency, damping, mode = work[3, :n], work[4, :na], work[5, :na], work[6, :3]
    band = numbers[LOWEST_HZ : LARGEST_DAMPING + 1]
    for t in range(u.shape[0]):
        shift_in(past[INPUT], u[t] if np.isfinite(u[t]) else past[INPUT, 0])
        shift_in(past[INPUT_F], through_pair(past[INPUT, 0], pair, past[INPUT_F]))
        if used[t] and e_prior[t] != 0.0:
            step[:] = theta[t] - before
            follow_correction(structure, pair, past, heard, e_prior[t], step, P, work)
        before[:] = theta[t]
        found = -1
        if reason[t] == USABLE:
            found = dominant(theta[t], na, structure[NK], numbers[SAMPLE_TIME_S], band, roots, mode)
        known = found >= 0 and heard[COUNT] >= numbers[AT_FEWEST]
        if known and mode[DAMPING] > 0.0 and squared(roots[found]) < 1.0:
            rho = residue(theta[t, na:], structure[NK], roots, found)
            keep_mode(mode[FREQUENCY_HZ], mode[DAMPING], roots[found], rho, last_mode)
        take_torque(past[INPUT, 0], okay[t], heard[DENSITY], numbers[SAMPLE_TIME_S], last_mode, through, block)
        out[t] = np.nan
        if found >= 0:
            take_pair(roots, found, pair)
            if used[t]:
                hear(e_prior[t], roots[found], numbers[AT_MEMORY], heard)
            out[t, FREQUENCY_HZ], out[t, DAMPING], out[t, HEIGHT] = mode[0], mode[1], mode[2]
        shift_in(past[Y_HAT], y_hat[t])
        shift_in(past[Y_HAT_F], through_pair(y_hat[t], pair, past[Y_HAT_F]))
        if known:
            deviations(numbers, roots, found, P, lasting, frequency, damping, out[t])
        if block[SAMPLES] == numbers[BLOCK]:
            end_block(numbers[AT_MEMORY], numbers[AT_OPENS], numbers[AT_CLOSES], block, lasting)


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """The resonance of every estimate of a block, each array of shape (n,); NaN where there is none."""

    frequency_hz: FloatArray  # of the dominant pole pair in the band [Hz]
    damping: FloatArray  # damping ratio
    height: FloatArray  # magnitude of the response there [output unit per input unit]
    frequency_std_hz: FloatArray  # standard deviation [Hz]
    damping_std: FloatArray  # standard deviation of the ratio


class Follower:
    """The recursion with its state; memory does not grow."""

    def __init__(self, orders: Orders, sample_time_s: float, band_hz: tuple[float, float], block: int) -> None:
        n = orders.n_parameters
        self._block = block
        self._structure = np.array([orders.na, orders.nb, orders.nk])
        self._numbers = np.array(
            [sample_time_s, *band_hz, LIGHTLY_DAMPED, MEMORY, SAMPLES_BEFORE_STD, block, OPENS, CLOSES]
        )
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
        """Verdict on the excitation of the last block."""
        return Excitation(int(self._live["lasting"][VERDICT]))

    @property
    def is_trusted(self) -> bool:
        """Whether the torque has excited the resonance for long."""
        return bool(self._live["lasting"][IN_A_ROW] >= TRUSTED)

    @property
    def to_block_end(self) -> int:
        """Samples until the next verdict, 1 or more."""
        return self._block - int(self._live["block"][SAMPLES])

    @property
    def at_block_end(self) -> bool:
        """Whether the last sample was the last of a block, so that the verdict is new."""
        return self.to_block_end == self._block

    def run(self, u: FloatArray, okay: BoolArray, estimates: Trajectory) -> Followed:
        """Follow the estimates of a block, which may have any length."""
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
        """Return what it remembers, by name: arrays that `restore` takes."""
        return {name: values.copy() for name, values in self._live.items()} | {"roots": self._roots.view(float).copy()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a state of a follower with the same settings."""
        for name, values in self._live.items():
            values[:] = state[name]
        self._roots.view(float)[:] = state["roots"]
