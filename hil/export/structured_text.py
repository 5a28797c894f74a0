"""The estimator as IEC 61131-3 Structured Text: the files of ``st/`` with its settings filled in.

They are written by hand, with ``$names`` where a setting goes, and keep to what edition 2 of IEC 61131-3 has (no
methods, no references, no enumerations), so that environments of any age take them. The tests execute the text and
compare it with `estimator` to the bit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import Enum
from importlib.resources import files
from string import Template
from typing import Final

import numpy as np

from estimator.errors import BadModel, BadSetting
from estimator.identification.modes.modes import LIGHTLY_DAMPED
from estimator.identification.online import adaptation, regression
from estimator.identification.settings import SAMPLES_PER_PARAMETER
from estimator.identification.tracking import follow, poles
from estimator.identification.tracking.watch import WatchSettings
from estimator.signals.decimate import UNTRUSTED
from hil.export.plc_estimator import PlcEstimator
from hil.version import __version__

POUS: Final = (
    "FB_HilDecimator", "FB_HilGain", "FB_HilOefo", "FB_HilExcitation", "FB_HilEstimator", "PRG_HilExample",
)  # fmt: skip
"""The POUs, each after those it uses."""

_HEAD: Final = Template(
    """\
(* On-line estimate of a driveline: written by hil $version, IEC 61131-3 Structured Text.

   Settings from: $origin
   Arithmetic: $arithmetic

   FB_HilEstimator is the one to call; it holds the others. PRG_HilExample shows how.
   All values are SI. Rotating quantities are reflected to the motor shaft. *)
"""
)

NUMBERS_PER_LINE: Final = 4


class Precision(Enum):
    """The real type of the PLC; the value is its name in IEC 61131-3."""

    DOUBLE = "LREAL"
    SINGLE = "REAL"

    @property
    def largest(self) -> float:
        """Value beyond which nothing is a measurement, such that nothing below it overflows.

        The largest number in the algorithm is f^2 D in Bierman's update, with D up to F(0) = 1e3 and f up to
        largest * RUNAWAY * (gain of 1 / L, taken as up to 1e3): (1e9 * 1e3 * 1e3)^2 * 1e3 = 1e33 < 3.4e38.
        """
        return regression.LARGEST if self is Precision.DOUBLE else 1e9

    def literal(self, value: float) -> str:
        """Return the shortest literal that reads back as the same number of this type."""
        with np.errstate(over="ignore", under="ignore"):
            rounded = float(value) if self is Precision.DOUBLE else np.float32(value)
        if not np.isfinite(rounded) or (rounded == 0.0) != (value == 0.0):
            raise BadSetting(
                f"PLC estimator: {self.value} has no number {value:g}, expected one it has. Leave out --single."
            )
        text = repr(rounded) if self is Precision.DOUBLE else str(rounded)
        mantissa, _, exponent = text.partition("e")
        return (mantissa if "." in mantissa else f"{mantissa}.0") + (f"E{int(exponent)}" if exponent else "")


def parts(estimator: PlcEstimator, precision: Precision = Precision.DOUBLE) -> tuple[str, str, tuple[str, ...]]:
    """Return the head, the data types and the text of each POU; ASCII only.

    Raises BadModel if the observation filter is not stable once its coefficients are rounded to the PLC's type, and
    BadSetting if a number is beyond that type.
    """
    filling = _Filling(_rounded(estimator, precision), precision)
    names = filling.names()

    def filled(name: str) -> str:
        text = (files("hil.export") / "st" / f"{name}.st").read_text(encoding="ascii")
        return re.sub(r"\bLREAL\b", precision.value, Template(text).substitute(names))

    return filling.head(), filled("types"), tuple(filled(name) for name in POUS)


def structured_text(estimator: PlcEstimator, precision: Precision = Precision.DOUBLE) -> str:
    """Return the whole text: head, data types, POUs; ready to import into a PLC project."""
    head, types, pous = parts(estimator, precision)
    return "\n".join((head, types, *pous))


def _rounded(estimator: PlcEstimator, precision: Precision) -> PlcEstimator:
    """Return the estimator with the filter that the PLC will have."""
    if estimator.L is None or precision is Precision.DOUBLE:
        return estimator
    try:
        return replace(estimator, L=estimator.L.astype(np.float32).astype(np.float64))
    except BadModel as cause:
        raise BadModel(f"rounded to REAL, {cause} Or leave out --single.") from cause


@dataclass(frozen=True, slots=True)
class _Filling:
    """What stands in the places of the files."""

    estimator: PlcEstimator
    precision: Precision

    def names(self) -> dict[str, object]:
        return self._decimator() | self._structure() | self._gain() | self._excitation()

    def head(self) -> str:
        kind = {Precision.DOUBLE: "64-bit (LREAL)", Precision.SINGLE: "32-bit (REAL)"}[self.precision]
        origin = re.sub(r"[^\x20-\x7e]", "?", self.estimator.origin).replace("*)", "* )").replace("(*", "( *")
        return _HEAD.substitute(version=__version__, origin=origin, arithmetic=kind)

    def _decimator(self) -> dict[str, object]:
        estimator, literal = self.estimator, self.precision.literal
        decimator = estimator.decimator()
        return {
            "cycle_s": f"{estimator.cycle_s:g}",
            "sample_time_s": f"{estimator.settings.sample_time_s:g}",
            "high_pass_hz": f"{estimator.settings.high_pass_hz:g}",
            "delay_s": f"{decimator.delay_samples * estimator.settings.sample_time_s:g}",
            "factor": estimator.factor,
            "n_taps": decimator.taps.shape[0],
            "taps": self._literals(decimator.taps.tolist()),
            "share": literal(decimator.share),
            "untrusted": literal(UNTRUSTED),
            "largest": literal(self.precision.largest),
        }

    def _structure(self) -> dict[str, object]:
        oefo, orders = self.estimator.oefo(), self.estimator.settings.orders
        coefficients = oefo.L[1:].tolist()
        return {
            "na": orders.na,
            "nb": orders.nb,
            "nk": orders.nk,
            "n": orders.n_parameters,
            "names": ", ".join(f"{k}1 .. {k}{n}" for k, n in (("a", orders.na), ("b", orders.nb)) if n),
            "last_delay": orders.nk + orders.nb - 1,
            "nl": len(coefficients),
            "nl_room": max(1, len(coefficients)),  # an array has at least one element
            "L": self._literals(coefficients or [0.0]),
            "adapt": _truth(self.estimator.L is None),
            "depth": self.estimator.depth,
            "start_up": SAMPLES_PER_PARAMETER * orders.n_parameters,
            "settled": round(regression.SETTLING * orders.n_parameters),
        }

    def _gain(self) -> dict[str, object]:
        literal = self.precision.literal
        law = self.estimator.settings.adaptation.law
        in_loops = law.as_array(self.estimator.settings.orders.n_parameters)
        return {
            "profile": type(self.estimator.settings.adaptation).__name__,
            "initial_gain": literal(law.initial_gain),
            "lambda1": literal(law.lambda1),
            "lambda0": literal(law.lambda0),
            "is_constant": _truth(law.lambda2 == 0.0),
            "trace": literal(float(in_loops[adaptation.TRACE])),
            "alpha": literal(law.alpha),
            "holds_at_once": _truth(law.holds_at_once),
            "known_gain": literal(adaptation.INFORMATION_GAIN),
            "learnt": literal(regression.LEARNT),
            "runaway": literal(regression.RUNAWAY),
        }

    def _excitation(self) -> dict[str, object]:
        literal, settings = self.precision.literal, self.estimator.settings
        period_s, (lowest, highest) = settings.sample_time_s, settings.band_hz
        samples = WatchSettings().block_samples(period_s)
        coarse = self.precision is Precision.SINGLE  # rounding leaves more of a change
        return {
            "na_room": max(1, settings.orders.na),
            "lowest_hz": f"{lowest:g}",
            "highest_hz": f"{highest:g}",
            "block": samples,
            "half_block": literal(0.5 * samples),
            "warm_rounds": poles.WARM_ROUNDS,
            "cold_rounds": poles.ROUNDS,
            "converged": literal(1e-5 if coarse else poles.CONVERGED),
            "coinciding": literal(1e-3 if coarse else poles.COINCIDING),
            "start_re": literal(poles.START.real),
            "start_im": literal(poles.START.imag),
            "rate": literal(1.0 / period_s),
            "turn": literal(2.0 * math.pi * period_s),
            "pi": literal(math.pi),
            "lowest": literal(lowest),
            "highest": literal(highest),
            "light": literal(LIGHTLY_DAMPED),
            "fewest": literal(follow.SAMPLES_BEFORE_STD),
            "memory": literal(follow.MEMORY),
            "share_of_block": literal(samples / follow.MEMORY),
            "opens": literal(follow.OPENS),
            "closes": literal(follow.CLOSES),
            "trusted": follow.TRUSTED,
        }

    def _literals(self, values: Iterable[float]) -> str:
        texts = [self.precision.literal(value) for value in values]
        rows = [", ".join(texts[first : first + NUMBERS_PER_LINE]) for first in range(0, len(texts), NUMBERS_PER_LINE)]
        return rows[0] if len(rows) == 1 else "\n        " + ",\n        ".join(rows)


def _truth(value: bool) -> str:
    return "TRUE" if value else "FALSE"
