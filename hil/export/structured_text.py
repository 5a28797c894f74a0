"""Prints an estimator as IEC 61131-3 Structured Text: the blocks in ``st/`` with the settings filled in.

The blocks are Structured Text themselves, written by hand, with ``$names`` where a setting goes. They keep to what
edition 2 of the standard has (no methods, no references, no enumerations), so that PLCopen-conforming environments of
any age take them. The tests execute the text that is printed here and compare it with `estimator` to the bit.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from importlib.resources import files
from string import Template
from typing import Final

import numpy as np

from estimator.identification.online import gain_kernel, regression_kernel
from estimator.signals.decimate_kernel import UNTRUSTED
from hil import __version__
from hil.export.plc_estimator import PlcEstimator

BLOCKS: Final = ("FB_HilDecimator", "FB_HilGain", "FB_HilOefo", "FB_HilEstimator")
"""The function blocks, each after those it uses."""

NUMBERS_PER_LINE: Final = 4

_HEAD: Final = Template(
    """\
(* ============================================================================================
   On-line estimate of a driveline: written by hil $version, IEC 61131-3 Structured Text.

   Settings from: $origin
   Arithmetic: $arithmetic

   FB_HilEstimator is the one to call; it holds the others.
   All values are SI. Rotating quantities are reflected to the motor shaft.
   ============================================================================================ *)

"""
)


class Precision(Enum):
    """The real type of the PLC; the value is its name in Structured Text."""

    DOUBLE = "LREAL"
    SINGLE = "REAL"

    @property
    def largest(self) -> float:
        """Value beyond which nothing is a measurement, such that nothing below it overflows.

        The largest number in the algorithm is f^2 D in Bierman's update, with D up to F(0) = 1e3 and f up to
        largest * RUNAWAY * (gain of 1 / L, taken as up to 1e3): (1e9 * 1e3 * 1e3)^2 * 1e3 = 1e33 < 3.4e38.
        """
        return regression_kernel.LARGEST if self is Precision.DOUBLE else 1e9

    def literal(self, value: float) -> str:
        """Return the shortest literal that reads back as the same number of this type."""
        text = repr(float(value)) if self is Precision.DOUBLE else str(np.float32(value))
        mantissa, _, exponent = text.partition("e")
        return (mantissa if "." in mantissa else f"{mantissa}.0") + (f"E{int(exponent)}" if exponent else "")


def structured_text(estimator: PlcEstimator, precision: Precision = Precision.DOUBLE) -> str:
    """Return the whole text: head and function blocks, ASCII only.

    Parameters
    ----------
    estimator : PlcEstimator
        What is exported.
    precision : Precision
        LREAL, or REAL for a PLC without it.

    Returns
    -------
    str
        One text, ready to import into a PLC project.
    """
    names = _Filling(estimator, precision).names()
    text = _HEAD.substitute(names) + "\n".join(_block(name).substitute(names) for name in BLOCKS)
    return re.sub(r"\bLREAL\b", precision.value, text)


def _block(name: str) -> Template:
    return Template((files("hil.export") / "st" / f"{name}.st").read_text(encoding="ascii"))


@dataclass(frozen=True, slots=True)
class _Filling:
    """What stands in the places of the blocks."""

    estimator: PlcEstimator
    precision: Precision

    def names(self) -> dict[str, object]:
        return self._head() | self._decimator() | self._structure() | self._gain()

    def _head(self) -> dict[str, object]:
        kind = {Precision.DOUBLE: "64-bit (LREAL)", Precision.SINGLE: "32-bit (REAL)"}[self.precision]
        origin = re.sub(r"[^\x20-\x7e]", "?", self.estimator.origin).replace("*)", "* )").replace("(*", "( *")
        return {"version": __version__, "origin": origin, "arithmetic": kind}

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
            "taps": self._table(decimator.taps.tolist()),
            "share": literal(decimator.share),
            "untrusted": literal(UNTRUSTED),
            "largest": literal(self.precision.largest),
        }

    def _structure(self) -> dict[str, object]:
        oefo, orders = self.estimator.oefo(), self.estimator.settings.orders
        coefficients = oefo.L[1:].tolist()
        depth = max(orders.na, orders.nk + orders.nb, len(coefficients) + 1)
        return {
            "na": orders.na,
            "nb": orders.nb,
            "nk": orders.nk,
            "n": orders.n_parameters,
            "last_delay": orders.nk + orders.nb - 1,
            "nl": len(coefficients),
            "nl_room": max(1, len(coefficients)),  # an array has at least one element
            "L": self._table(coefficients or [0.0]),
            "adapt": _truth(self.estimator.adapts_filter),
            "depth": depth,
            "start_up": self.estimator.start_up_samples,
            "settled": round(regression_kernel.SETTLING * orders.n_parameters),
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
            "trace": literal(float(in_loops[gain_kernel.TRACE])),
            "alpha": literal(law.alpha),
            "holds_at_once": _truth(law.holds_at_once),
            "known_gain": literal(gain_kernel.INFORMATION_GAIN),
            "learnt": literal(regression_kernel.LEARNT),
            "runaway": literal(regression_kernel.RUNAWAY),
        }

    def _table(self, values: Iterable[float]) -> str:
        """Return the numbers of an array, some per line."""
        written = [self.precision.literal(value) for value in values]
        rows = (written[i : i + NUMBERS_PER_LINE] for i in range(0, len(written), NUMBERS_PER_LINE))
        return ",\n".join("        " + ", ".join(row) for row in rows)


def _truth(value: bool) -> str:
    return "TRUE" if value else "FALSE"
