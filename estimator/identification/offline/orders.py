"""Order and delay: how many coefficients the data pay for.

Every candidate is a Box-Jenkins model with a noise model of its own, all of one order, so the Bayesian information
criterion (G. Schwarz, Annals of Statistics 6, 1978) counts innovations, which are independent::

    BIC = N ln(mean of w^2) + (number of parameters) ln N
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.errors import BadSetting
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.offline.fits import LinearFit, fit_box_jenkins, free_run
from estimator.signals.decimate import decimate
from estimator.signals.record import Record

DEFAULT = tuple(Orders(n, n, nk) for nk in (1, 2, 3) for n in (2, 3, 4, 5))
"""Second to fifth order, a delay of one to three samples."""


LOWEST_HZ = 2.0
"""Corner of the high-pass before orders are compared [Hz]; a drive's resonance is looked for from there on."""


SETTLING = 5.0
"""Time constants of the high-pass that are left out: a constant acceleration leaves a transient there, which a further
pole would be taken to explain."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One structure and how it did."""

    orders: Orders
    criterion: float  # BIC less that of the best
    rms: float  # of the whitened simulation error [output unit]
    unseen_fit_percent: float  # free-run fit over all recordings held out
    model: LinearModel


@dataclass(frozen=True, slots=True)
class OrderChoice:
    """Every candidate, the best by the criterion first."""

    candidates: tuple[Candidate, ...]

    @property
    def chosen(self) -> Orders:
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
