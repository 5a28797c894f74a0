"""Settings of an identification, and whether the data can determine the model asked for, before any fit can look good.

An input excites persistently of order p if its p delayed copies are linearly independent; p of them determine
p parameters (L. Ljung, System Identification, 2nd ed., chapter 13: a sine gives 2, a constant 1, a PRBS its period).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from estimator.errors import BadSetting, NotExciting
from estimator.identification.linear_model import Orders, singular_values
from estimator.identification.online.adaptation import Adaptation, DecreasingThenConstantTrace
from estimator.identification.online.estimators import Oefo
from estimator.signals.decimate import HIGH_PASS_HZ, decimate, first_part, high_passed
from estimator.signals.record import BoolArray, FloatArray, Record
from estimator.signals.settings import Requirement, is_positive, require

SAMPLES_PER_PARAMETER = 10  # good samples asked for per parameter; fewer fit the noise as well as the system

RELATIVE_RANK = 1e-6
"""Singular value, against the largest, below which delayed copies count as dependent.

Well above rounding (1e-15) and well below the least that the anti-alias filter leaves
of a PRBS, 50 dB down at the upper edge of the band.
"""


def excitation_order(u: FloatArray, highest: int) -> int:
    """Return the order up to ``highest`` to which the input excites persistently."""
    if u.shape[0] < highest:
        return 0
    copies = np.lib.stride_tricks.sliding_window_view(u, highest)
    singular = singular_values(copies)
    return int(np.count_nonzero(singular > RELATIVE_RANK * singular[0])) if singular[0] > 0 else 0


def require_excitation(name: str, u: FloatArray, y: FloatArray, okay: BoolArray, orders: Orders) -> None:
    """Refuse data that can't determine a model of these orders."""
    n = orders.n_parameters
    good = int(np.count_nonzero(okay))
    if good < SAMPLES_PER_PARAMETER * n:
        raise NotExciting(
            f"recording {name}: {good} good samples, expected at least {SAMPLES_PER_PARAMETER * n} for {n} "
            "parameters. Record longer, mask less, or lower the orders.",
            orders.names,
        )
    order = excitation_order(u, n)
    if order < n:
        names = _beyond(order, orders)
        raise NotExciting(
            f"recording {name}: the torque excites {order} parameters, expected {n}; "
            f"{', '.join(names)} can't be determined. Let the torque vary: superpose a PRBS on it.",
            names,
        )
    if np.ptp(y[okay]) == 0.0:
        raise NotExciting(
            f"recording {name}: the measured output never changes while the torque does; no parameter can be "
            "determined. Check the sensor and its scale.",
            orders.names,
        )


def _beyond(order: int, orders: Orders) -> tuple[str, ...]:
    """Return the parameters that ``order`` independent copies leave over, numerator served first."""
    nb = min(orders.nb, order - order // 2)
    na = min(orders.na, order - nb)
    a = [f"a_{i}" for i in range(na + 1, orders.na + 1)]
    return (*a, *(f"b_{j}" for j in range(nb + 1, orders.nb + 1)))


class FilterPart(Enum):
    """What of the batch model's A makes the observation filter L."""

    OSCILLATING = "oscillating"
    ALL = "all"


@dataclass(frozen=True, slots=True)
class Settings:
    """How to identify; the defaults are the paper's where it gives them.

    Attributes
    ----------
    orders : Orders
        na = nb = 4, nk = 1.
    sample_time_s : float
        Sampling period of the on-line model [s].
    offline_sample_time_s : float or None
        That of the off-line models [s]; None for the recording's own.
    high_pass_hz : float
        Corner of the high-pass [Hz].
    samples : int or None
        Good samples the recursive estimate is run through; None for all.
    adaptation : Adaptation
        Adaptation-gain profile of the recursive estimate.
    filter_part : FilterPart
        What of the batch model's A makes L.
    band_hz : tuple of float
        Where the resonance is looked for [Hz].
    """

    orders: Orders = field(default_factory=Orders)
    sample_time_s: float = 0.02
    offline_sample_time_s: float | None = None
    high_pass_hz: float = HIGH_PASS_HZ
    samples: int | None = 1024
    adaptation: Adaptation = field(default_factory=DecreasingThenConstantTrace)
    filter_part: FilterPart = FilterPart.OSCILLATING
    band_hz: tuple[float, float] = (2.0, 25.0)

    def __post_init__(self) -> None:
        low, high = self.band_hz
        period, samples = self.sample_time_s, self.samples
        require(
            "identification",
            (
                Requirement("sample_time_s", period, is_positive(period), "a period above 0 s"),
                Requirement("samples", samples or 0, samples is None or samples > 0, "1 or more, or none"),
                Requirement("band_hz", low, 0 <= low < high, f"a lower end from 0 up to its upper end {high}"),
            ),
        )

    def factor(self, record: Record) -> int:
        """Return the decimation factor from a recording's period to the models'.

        Raises
        ------
        BadSetting
            If the recording's period does not divide that of the models.
        """
        ratio = self.sample_time_s / record.sample_time_s
        factor = round(ratio)
        if factor < 1 or abs(ratio - factor) > 1e-3 * ratio:
            raise BadSetting(
                f"recording {record.name}: sampled every {record.sample_time_s:g} s, expected a whole "
                f"fraction of the models' period {self.sample_time_s:g} s. Choose another for the models."
            )
        return factor

    def offline(self, record: Record) -> Record:
        """Return a recording as the off-line models take it: high-passed, at their period, a long one's first part.

        Raises
        ------
        BadSetting
            As :meth:`factor`.
        """
        record = first_part(record)
        if self.offline_sample_time_s is None:
            return high_passed(record, self.high_pass_hz)
        factor = replace(self, sample_time_s=self.offline_sample_time_s).factor(record)
        return decimate(record, factor, self.high_pass_hz)

    def estimator(self, L: FloatArray) -> Oefo:
        """Return the recursive estimator of these settings with an observation filter, ready for samples."""
        start_up = SAMPLES_PER_PARAMETER * self.orders.n_parameters
        return Oefo(L, self.orders, self.adaptation, start_up_samples=start_up)
