"""Order and delay: how many coefficients the data pay for.

Every candidate is a Box-Jenkins model with a noise model of its own, all of one order, so the Bayesian information
criterion (G. Schwarz, Annals of Statistics 6, 1978) counts innovations, which are independent::

    BIC = N ln(mean of w^2) + (number of parameters) ln N

An output-error model is judged by its transfer function, so by the independence of residual and past input; whiteness
of the residual is a matter of the noise model, and its autocorrelation is shown besides without a verdict (L. Ljung,
System Identification, 2nd ed., section 16.6). Both signals are made white first, the residual by its own
autoregression D and the input by one of its own (G. E. P. Box, G. M. Jenkins, Time Series Analysis, "prewhitening"),
so that under independence each correlation is normal with variance 1 / N, whatever the colours, and those at m lags
together::

    r(tau) = sum w(t) v(t - tau) / sqrt(sum w^2 sum v^2),      N sum r(tau)^2 ~ chi-square(m)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from estimator.errors import BadSetting
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.modes.modes import CONFIDENCE, QUANTILE
from estimator.identification.offline.fits import FreeRun, LinearFit, fit_box_jenkins, fit_noise, free_run, reach
from estimator.signals.decimate import Blocks, decimate
from estimator.signals.record import BoolArray, FloatArray, IntArray, Record

DEFAULT = tuple(Orders(n, n, nk) for nk in (1, 2, 3) for n in (2, 3, 4, 5))
"""Second to fifth order, a delay of one to three samples."""


LOWEST_HZ = 2.0
"""Corner of the high-pass before orders are compared [Hz]; a drive's resonance is looked for from there on."""


SETTLING = 5.0
"""Time constants of the high-pass that are left out: a constant acceleration leaves a transient there, which a further
pole would be taken to explain."""

LAGS = 25  # lags looked at to either side: half a second at 20 ms, the decay time of a drive's resonance

JUMP = 1.2
"""Gap in the sizes of an input's steps, as a ratio, beyond which the larger ones are jumps of an excitation."""

LEAST_CORRELATED = 0.05
"""Root of the sum of squared correlations, beyond what chance makes of it, below which a model misses nothing that
matters: in a recording of a million samples the smallest departure is significant."""

LEAST_DELAY = 1  # samples before which held torque can't act on a sampled speed

SIGNIFICANCE = 0.01  # false alarms of the detection, on recordings in open loop


@dataclass(frozen=True, slots=True)
class Candidate:
    """One structure and how it did."""

    orders: Orders  # of the structure
    criterion: float  # BIC less that of the best
    rms: float  # of the whitened simulation error [output unit]
    unseen_fit_percent: float  # free-run fit over all recordings held out
    model: LinearModel  # as fitted


@dataclass(frozen=True, slots=True)
class OrderChoice:
    """Every candidate, the best by the criterion first."""

    candidates: tuple[Candidate, ...]  # all that were tried

    @property
    def chosen(self) -> Orders:
        """The orders with the least criterion."""
        return self.candidates[0].orders

    @property
    def statement(self) -> str:
        """The choice, how clear it is, and what unseen recordings say of it."""
        best, *rest = self.candidates
        text = f"na = {best.orders.na}, nb = {best.orders.nb}, nk = {best.orders.nk}"
        text += f", by a BIC {rest[0].criterion:.1f} below the next." if rest else "."
        if np.isnan(best.unseen_fit_percent):
            return text
        winner = max(self.candidates, key=lambda candidate: candidate.unseen_fit_percent)
        agree = (
            "which is best there too"
            if winner is best
            else (
                f"best there is na = {winner.orders.na}, nb = {winner.orders.nb}, nk = {winner.orders.nk} with "
                f"{winner.unseen_fit_percent:.1f} %"
            )
        )
        return f"{text} Free-run fit on unseen recordings {best.unseen_fit_percent:.1f} %, {agree}."


def select_orders(record: Record, among: Sequence[Orders] = DEFAULT, unseen: Sequence[Record] = ()) -> OrderChoice:
    """Fit all candidates and rank them by BIC; on unseen recordings each is only simulated."""
    if not among:
        raise BadSetting("order selection: 0 candidates, expected one or more. Give the orders to choose from.")
    prepared, *others = (_prepared(one) for one in (record, *unseen))
    found = [_candidate(prepared, orders, others) for orders in among]
    least = min(candidate.criterion for candidate in found)
    ranked = sorted(found, key=lambda candidate: candidate.criterion)
    return OrderChoice(tuple(replace(candidate, criterion=candidate.criterion - least) for candidate in ranked))


def _prepared(record: Record) -> Record:
    """Return a recording without its slow part and without the high-pass's own settling."""
    passed = decimate(record, 1, LOWEST_HZ)
    settled = np.arange(passed.okay.shape[0]) * passed.sample_time_s >= SETTLING / (2.0 * np.pi * LOWEST_HZ)
    return replace(passed, okay=passed.okay & settled)


def _candidate(record: Record, orders: Orders, unseen: Sequence[Record]) -> Candidate:
    fit = fit_box_jenkins(record, orders)
    runs = [free_run(fit.model, other, fit.noise).fit_percent for other in unseen]
    return Candidate(
        orders=orders,
        criterion=criterion(fit),
        rms=fit.noise.std,
        unseen_fit_percent=float(np.mean(runs)) if runs else float("nan"),
        model=fit.model,
    )


def criterion(fit: LinearFit) -> float:
    """Return the BIC of a Box-Jenkins fit; to be compared on one recording and with one order of D."""
    n = fit.n_samples / fit.block
    power = max(fit.noise.std**2, np.finfo(np.float64).tiny)
    return n * float(np.log(power)) + fit.model.orders.n_parameters * float(np.log(n))


@dataclass(frozen=True, slots=True, eq=False)
class CorrelationTest:
    """Correlations by lag with the bound that 95 % of them keep if there is none."""

    lag: IntArray  # (m,): samples
    correlation: FloatArray  # (m,)
    bound: float  # 95 % of independent correlations are smaller in size
    p_value: float  # probability of correlations like these if there are none

    @property
    def is_independent(self) -> bool:
        """Tell whether the correlations are no larger than chance makes them, with 95 % confidence, or don't matter."""
        by_chance = self.lag.shape[0] * (self.bound / QUANTILE) ** 2
        beyond = float(self.correlation @ self.correlation) - by_chance
        return self.p_value > 1.0 - CONFIDENCE or beyond < LEAST_CORRELATED**2


@dataclass(frozen=True, slots=True, eq=False)
class Validation:
    """What can be said for and against a fit."""

    own: FreeRun  # on the recording it was fitted to
    unseen: tuple[FreeRun, ...]  # on others
    independence: CorrelationTest  # residual against past input
    feedback: CorrelationTest  # residual against input too late to have caused it
    autocorrelation: CorrelationTest  # of the free-run residual, not whitened

    @property
    def statement(self) -> str:
        """The result in a few sentences, the free-run fit first."""
        others = "".join(f"; on {run.name}, unseen, {run.fit_percent:.1f} %" for run in self.unseen)
        judged = "independent of" if self.independence.is_independent else "correlated with"
        verdict = "the model holds" if self.independence.is_independent else "it misses a part of the response"
        return (
            f"Free-run fit {self.own.fit_percent:.1f} %{others} (one step ahead {self.own.one_step_fit_percent:.1f} %, "
            f"which is no measure of a model to simulate with). The residual is {judged} the past input "
            f"(p = {self.independence.p_value:.2g}): {verdict}."
        )


def validate(fit: LinearFit, record: Record, unseen: Sequence[Record] = (), lags: int = LAGS) -> Validation:
    """Test a fit: free runs on its own and on unseen recordings, and whether its innovations are independent."""
    own = free_run(fit.model, record, fit.noise)
    tests = residual_tests(own.error, record, fit.block, min(fit.model.nk, LEAST_DELAY), lags)
    return Validation(own, tuple(free_run(fit.model, other, fit.noise) for other in unseen), *tests)


def residual_tests(
    error: FloatArray, record: Record, block: int, first: int = LEAST_DELAY, lags: int = LAGS
) -> tuple[CorrelationTest, CorrelationTest, CorrelationTest]:
    """Correlate what a simulation leaves with past input, with later input, and with itself."""
    blocks = Blocks(record.okay & np.isfinite(error), block)
    residual = blocks.mean(np.nan_to_num(error))
    u = Blocks(np.ones_like(record.okay), block).mean(record.total_torque_nm)
    with threadpool_limits(1):
        white_error, white_input, both = _prewhitened(residual, u, blocks.okay, record.sample_time_s * block)
        answer = between_jumps(u)
        white_answer = fit_noise(answer, np.ones_like(both), reach(record.sample_time_s * block)).whiten(answer)
    late = np.arange(-lags, first if block == 1 else 0)  # within one block both directions are possible
    looks = [correlation_test(white_error, x, both, late) for x in (white_input, white_answer)]
    feedback = min(looks, key=lambda look: look.p_value)
    return (
        correlation_test(white_error, white_input, both, np.arange(first, first + lags)),
        replace(feedback, p_value=min(1.0, len(looks) * feedback.p_value)),
        correlation_test(residual, residual, blocks.okay, np.arange(1, lags + 1)),
    )


def between_jumps(u: FloatArray) -> FloatArray:
    """Return the steps of an input without its jumps, shape (N,).

    Next to a PRBS of 100 Nm a driver's answer of 1 Nm to the noise of the speed is not seen; between its jumps it is.
    Any function of the input is independent of the residual where the loop is open, so that the test keeps its level.
    """
    step = np.diff(u, prepend=u[:1])
    size = np.abs(step - np.median(step))
    ordered, first, end = np.sort(size), size.shape[0] // 4, size.shape[0] - size.shape[0] // 50
    if end - first < 2 or not ordered[-1] > 0.0:
        return step
    ratio = ordered[first + 1 : end] / np.maximum(ordered[first : end - 1], 1e-9 * ordered[-1])
    widest = int(np.argmax(ratio))
    small = size <= (ordered[first + widest] if ratio[widest] > JUMP else np.inf)
    return np.where(small, step - step[small].mean(), 0.0)


def _prewhitened(
    error: FloatArray, u: FloatArray, okay: BoolArray, period_s: float
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return residual and input, each whitened by its own autoregression, and where both have their past."""
    everywhere = np.ones_like(okay)
    order = reach(period_s)
    of_error, of_input = fit_noise(error, okay, order), fit_noise(u - u.mean(), everywhere, order)
    both = of_error.complete(okay) & of_input.complete(everywhere)
    return of_error.whiten(error), of_input.whiten(u - u.mean()), both


def correlation_test(e: FloatArray, x: FloatArray, okay: BoolArray, lags: IntArray) -> CorrelationTest:
    """Correlate ``e(t)`` with ``x(t - lag)`` where both samples are good."""
    e, x = np.where(okay, e, 0.0), np.where(okay, x, 0.0)
    n = max(int(np.count_nonzero(okay)), 1)
    size = float(np.sqrt((e @ e) * (x @ x)))
    if size == 0.0:
        return CorrelationTest(lags, np.zeros(lags.shape), QUANTILE / np.sqrt(n), 1.0)
    r = np.array([_product(e, x, int(lag)) for lag in lags]) / size
    together = float(chi2.sf(n * float(r @ r), lags.shape[0]))
    largest = lags.shape[0] * float(chi2.sf(n * float(np.max(r**2)), 1))
    return CorrelationTest(lags, r, float(QUANTILE / np.sqrt(n)), min(1.0, 2.0 * min(together, largest)))


def _product(e: FloatArray, x: FloatArray, lag: int) -> float:
    if lag >= 0:
        return float(e[lag:] @ x[: x.shape[0] - lag])
    return float(e[:lag] @ x[-lag:])


@dataclass(frozen=True, slots=True)
class Feedback:
    """Whether there was feedback and what it means."""

    detected: bool  # whether the torque depends on the past speed
    p_value: float  # probability of so much dependence by chance
    statement: str  # one sentence for people


def judge_feedback(validation: Validation) -> Feedback:
    """Tell from a validated fit whether its recording was made in closed loop."""
    p_value = validation.feedback.p_value
    if p_value > SIGNIFICANCE:
        statement = f"No sign of the torque following the speed (p = {p_value:.2g})."
        return Feedback(False, p_value, statement)
    statement = (
        f"The torque follows the speed (p = {p_value:.2g}): a driver or controller closes the loop. The output-error, "
        "recursive and spectral estimates are biased by the noise it feeds back. Use the Box-Jenkins model, or "
        "hold the torque except for the PRBS."
    )
    return Feedback(True, p_value, statement)
