"""How many samples lie between torque and speed: output-error models of every delay, judged by their error.

A sampled driveline has a delay of one sample by itself (nk = 1, `estimator.identification.linear_model`); one more is a
sample of dead time in bus, inverter or resolver. All candidates have as many parameters, so that the least error is
the least information criterion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from estimator.identification.linear_model import Orders
from estimator.signals.decimate import decimate
from estimator.signals.record import Record
from hil.commission.analysis.response_ratio import HIGH_PASS_HZ

if TYPE_CHECKING:
    from estimator.identification.offline.fits import LinearFit

NATURAL_DELAY = 1
"""Samples of delay that sampling alone makes."""

LONGEST = 5
"""Longest delay tried [samples]."""


@dataclass(frozen=True, slots=True)
class DelaySelection:
    """The delay that suits best, beyond the sample that is natural, and the model with it."""

    extra_samples: int
    fit: LinearFit
    rms_by_delay: tuple[float, ...]


def select_delay(record: Record) -> DelaySelection:
    """Choose the delay from torque to speed.

    Raises
    ------
    NotExciting
        If the recording can't determine a model.
    """
    data = decimate(record, 1, HIGH_PASS_HZ)
    from estimator.identification.offline.fits import fit_output_error  # a second, and the bus comes first

    fits = [fit_output_error(data, Orders(nk=nk)) for nk in range(NATURAL_DELAY, LONGEST + 1)]
    best = min(range(len(fits)), key=lambda i: fits[i].rms)
    return DelaySelection(best, fits[best], tuple(fit.rms for fit in fits))
