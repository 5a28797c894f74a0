"""What an estimator on a PLC is made of: the settings of the host's on-line chain, and the chain's own numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from estimator.errors import BadSetting
from estimator.identification.chain import OnlineChain, oefo
from estimator.identification.online.oefo import Oefo
from estimator.identification.settings import SAMPLES_PER_PARAMETER, Settings
from estimator.signals.decimate import Decimator, low_pass_length
from estimator.signals.record import FloatArray

PLC_WORD = 32767
"""Largest INT of IEC 61131-3. Array sizes stay below it: a loop to it would count beyond and never end."""


@dataclass(frozen=True, slots=True, eq=False)
class PlcEstimator:
    """The estimator that is exported: what `OnlineChain` is on the host, from the same three settings.

    Attributes
    ----------
    settings : Settings
        Orders, periods, high-pass and adaptation profile.
    cycle_s : float
        Period of the PLC task that calls the estimator [s]; the models' period is a whole multiple of it.
    L : ndarray or None
        Denominator ``1, l_1 ..`` of the observation filter; None: it follows each stable A.
    origin : str
        Where the settings come from, for the head of the text.

    Raises
    ------
    BadSetting
        If ``cycle_s`` does not divide the models' period, or an index would not fit a PLC's INT.
    BadModel
        If L is no stable polynomial.
    """

    settings: Settings = field(default_factory=Settings)
    cycle_s: float = 0.01
    L: FloatArray | None = None
    origin: str = "the defaults"

    def __post_init__(self) -> None:
        for array, size, cure in self._arrays():
            if size >= PLC_WORD:
                raise BadSetting(
                    f"PLC estimator: {array} has {size:.0f} elements, expected fewer than {PLC_WORD}, the largest INT "
                    f"of a PLC. {cure}"
                )
        OnlineChain(self.settings, self.cycle_s, self.L)

    def _arrays(self) -> Iterator[tuple[str, float, str]]:
        """Yield the largest arrays, each with its size and what makes it smaller."""
        orders = self.settings.orders
        if self.cycle_s > 0.0:  # what is no period is refused by the chain
            taps = low_pass_length(self.settings.sample_time_s / self.cycle_s)
            yield "the low-pass", taps, f"Call it less often than every {self.cycle_s:g} s."
        yield "the memory", self.depth, "Lower the orders, the delay, or the order of the observation filter."
        yield "the gain F", orders.n_parameters**2, "Lower the orders."

    @property
    def depth(self) -> int:
        """Samples that are remembered."""
        orders = self.settings.orders
        filter_order = orders.na if self.L is None else self.L.shape[0] - 1
        return max(orders.na, orders.nk + orders.nb, filter_order + 1)

    @property
    def adapts_filter(self) -> bool:
        """Whether the observation filter follows the estimate."""
        return self.L is None

    @property
    def factor(self) -> int:
        """Cycles per sample of the model."""
        return round(self.settings.sample_time_s / self.cycle_s)

    @property
    def start_up_samples(self) -> int:
        """Good samples at the start that are learnt from without the filter."""
        return SAMPLES_PER_PARAMETER * self.settings.orders.n_parameters

    def decimator(self) -> Decimator:
        """Return the host's own decimator of these settings, ready for samples."""
        return Decimator(self.cycle_s, self.factor, self.settings.high_pass_hz)

    def oefo(self) -> Oefo:
        """Return the host's own estimator of these settings, ready for samples."""
        return oefo(self.settings, self.L)
