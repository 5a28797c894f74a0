"""What an estimator on a PLC is made of: the settings of the host's on-line chain, and the chain's own numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from estimator.errors import BadModel, BadSetting
from estimator.identification.chain import OnlineChain, oefo
from estimator.identification.online.adaptation import PROFILES as KINDS, Adaptation
from estimator.identification.online.estimators import Oefo
from estimator.identification.settings import Settings
from estimator.signals.decimate import Decimator, low_pass_length
from estimator.signals.record import FloatArray
from hil.errors import FileProblem, UsageError
from hil.report.identification_input import identified

PROFILES: Final[Mapping[str, type[Any]]] = MappingProxyType(
    {re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower(): kind for kind in KINDS}
)
"""Every profile by its name."""

PLC_WORD = 32767
"""Largest INT of IEC 61131-3. Array sizes stay below it: a loop to it would count beyond and never end."""


def profile(text: str) -> Adaptation:
    """Read ``NAME[:key=value,...]``; `UsageError` where it names no profile, or keys that it has not."""
    name, _, rest = text.partition(":")
    kind = PROFILES.get(name.strip())
    if kind is None:
        raise UsageError(f"profile {name!r}: expected one of {', '.join(PROFILES)}")
    known = [field.name for field in fields(kind)]
    values: dict[str, float] = {}
    for part in rest.split(",") if rest else ():
        key, _, number = (piece.strip() for piece in part.partition("="))
        if key not in known or key in values:
            raise UsageError(f"profile {text!r}: expected each of {', '.join(known)} at most once, got {part!r}")
        try:
            values[key] = float(number)
        except ValueError as error:
            raise UsageError(f"profile {text!r}: expected {key}=number, got {part!r}") from error
    made: Adaptation = kind(**values)
    made.law  # noqa: B018 - checks the numbers
    return made


@dataclass(frozen=True, slots=True, eq=False)
class PlcEstimator:
    """The estimator that is exported: what `OnlineChain` is on the host, from the same three settings."""

    settings: Settings = field(default_factory=Settings)  # orders, periods, high-pass and adaptation profile
    cycle_s: float = 0.01  # time between two calls on the PLC
    L: FloatArray | None = None  # denominator ``1, l_1 ..`` of the observation filter
    origin: str = "the defaults"  # where the settings come from, for the head of the text

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
    def factor(self) -> int:
        """Cycles per sample of the model."""
        return round(self.settings.sample_time_s / self.cycle_s)

    def decimator(self) -> Decimator:
        """Return the host's own decimator of these settings, ready for samples."""
        return Decimator(self.cycle_s, self.factor, self.settings.high_pass_hz)

    def oefo(self) -> Oefo:
        """Return the host's own estimator of these settings, ready for samples."""
        return oefo(self.settings, self.L)


def plc_estimator(
    path: Path, run: str | None, cycle_s: float, adaptation: Adaptation, adaptive: bool = False
) -> PlcEstimator:
    """Return the estimator with the settings and the filter that identified a recording."""
    found = identified(path, run, adaptation)
    origin = f"{path.name}, recording {found.name}"
    try:
        return PlcEstimator(found.settings, cycle_s, None if adaptive else found.L, origin)
    except BadModel as cause:
        raise FileProblem(path, f"recordings.{found.name}.filter_L | {cause}") from cause
    except BadSetting as cause:
        raise FileProblem(path, f"settings | {cause}") from cause


def written_estimator(
    identification: Path | None, run: str | None, adaptive: bool, cycle_s: float, profile_text: str
) -> PlcEstimator:
    """Return the estimator that the arguments of a command describe."""
    adaptation = profile(profile_text)
    if identification is not None:
        return plc_estimator(identification, run, cycle_s, adaptation, adaptive)
    if run is not None:
        raise UsageError(f"--run {run}: expected the identification.json that holds it, got no file")
    if not adaptive:
        raise UsageError(
            "expected identification.json, whose model gives the observation filter, got no file. Make it by: hil "
            "identify; or let the filter follow the estimate: --adaptive"
        )
    return PlcEstimator(Settings(adaptation=adaptation), cycle_s, None, "the defaults, filter adapted on line")
