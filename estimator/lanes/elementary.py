"""The exponential, the logarithm, the sine and the cosine of lanes."""

from __future__ import annotations

import math
from typing import Any

from llvmlite import ir

from estimator.lanes.tools import intrinsic, overload, register_jitable, types
from estimator.lanes.types import BITS, LANES, NUMBERS, lanes

LARGEST = 708.0
"""Beyond this the exponential leaves the range of a number; it stays at its end."""

LOG2_E = 1.4426950408889634
LN_2, LN_2_HIGH, LN_2_LOW = 0.6931471805599453, 6.93147180369123816490e-01, 1.90821492927058770002e-10
WHOLE = 6755399441055744.0
"""Added to a number, ``1.5 * 2**52`` leaves its whole part in the last bits."""

TWO_BY_PI = 0.6366197723675814
QUARTER_HIGH, QUARTER_MIDDLE = 1.57079632673412561417e00, 6.07710050630396597660e-11
QUARTER_LOW = 2.02226624879595063154e-21
"""Parts of a quarter turn; times a whole number up to a million the first two are exact."""

_BITS_OF_WHOLE = 0x4338000000000000
_BITS_OF_HALF_OCTAVE = 0x3FE6A09E667F3BCD
_MANTISSA_BITS, _EXPONENT_OF_1 = 52, 1023


def _bits(value: int) -> Any:
    return ir.Constant(BITS, [value] * LANES)


@intrinsic
def _times_power_of_2(typingctx: Any, x: Any, exponent: Any) -> Any:
    """Multiply by ``2**k`` where ``exponent`` is ``WHOLE + k``."""

    def made(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        k = builder.add(builder.bitcast(args[1], BITS), _bits(_EXPONENT_OF_1))
        return builder.fmul(args[0], builder.bitcast(builder.shl(k, _bits(_MANTISSA_BITS)), NUMBERS))

    return lanes(lanes, lanes), made


@intrinsic
def _mantissa_and_exponent(typingctx: Any, x: Any) -> Any:
    """Split a positive number into ``m 2**k`` with m between the roots of 1/2 and of 2."""

    def made(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        whole = builder.bitcast(args[0], BITS)
        above = builder.sub(whole, _bits(_BITS_OF_HALF_OCTAVE))
        mantissa = builder.sub(whole, builder.and_(above, _bits(-(2**_MANTISSA_BITS))))
        exponent = builder.add(builder.ashr(above, _bits(_MANTISSA_BITS)), _bits(_BITS_OF_WHOLE))
        k = builder.fsub(builder.bitcast(exponent, NUMBERS), ir.Constant(NUMBERS, [WHOLE] * LANES))
        return context.make_tuple(builder, sig.return_type, (builder.bitcast(mantissa, NUMBERS), k))

    return types.UniTuple(lanes, 2)(lanes), made


def _exponential(x: Any) -> Any:
    """Return ``e**x``: a power of two times a Taylor polynomial over half an octave on either side of 1.

    Its terms are added in pairs (Estrin's scheme): a chain of one after the other would wait for itself.
    """
    x = min(max(x, -LARGEST), LARGEST)
    k = x * LOG2_E + WHOLE
    whole = k - WHOLE
    r = (x - whole * LN_2_HIGH) - whole * LN_2_LOW
    r2 = r * r
    r4 = r2 * r2
    first = (1.0 + r) + r2 * (1.0 / 2.0 + r * (1.0 / 6.0))
    second = (1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0 + r * (1.0 / 5040.0))
    third = (1.0 / 40320.0 + r * (1.0 / 362880.0)) + r2 * (1.0 / 3628800.0 + r * (1.0 / 39916800.0))
    third += r4 * (1.0 / 479001600.0 + r * (1.0 / 6227020800.0))
    return _times_power_of_2(first + r4 * (second + r4 * third), k)


def _logarithm(x: Any) -> Any:
    """Return the natural logarithm of a positive number (fdlibm's ``e_log.c``, Sun Microsystems, 1993)."""
    mantissa, k = _mantissa_and_exponent(x)
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01))
    odd = (6.666666666666735130e-01 + w * 2.857142874366239149e-01) + w * w * (
        1.818357216161805012e-01 + w * 1.479819860511658591e-01
    )
    return k * LN_2 + (2.0 * s + s * (even + z * odd))


@overload(math.exp, strict=False)
def _exp(x: Any) -> Any:
    return _exponential if x is lanes else None


@overload(math.log, strict=False)
def _log(x: Any) -> Any:
    return _logarithm if x is lanes else None


@intrinsic
def _quarter_turn(typingctx: Any, quarter: Any, sine: Any, cosine: Any) -> Any:
    """Return the sine of what is ``WHOLE + q`` quarter turns beyond an angle with this sine and cosine."""

    def made(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits, (_, sine, cosine) = builder.bitcast(args[0], BITS), args
        odd = builder.icmp_signed("!=", builder.and_(bits, _bits(1)), _bits(0))
        sign = builder.shl(builder.and_(bits, _bits(2)), _bits(62))
        value = builder.bitcast(builder.select(odd, cosine, sine), BITS)
        return builder.bitcast(builder.xor(value, sign), NUMBERS)

    return lanes(lanes, lanes, lanes), made


@register_jitable
def _sine_beyond(x: Any, quarters: Any) -> Any:
    """Return the sine of an angle and so many quarter turns (fdlibm: ``k_sin.c``, ``k_cos.c``, ``e_rem_pio2.c``)."""
    whole = x * TWO_BY_PI + WHOLE
    count = whole - WHOLE
    r = ((x - count * QUARTER_HIGH) - count * QUARTER_MIDDLE) - count * QUARTER_LOW
    z = r * r
    w = z * z
    sine = (8.33333333332248946124e-03 + z * -1.98412698298579493134e-04) + w * (
        (2.75573137070700676789e-06 + z * -2.50507602534068634195e-08) + w * 1.58969099521155010221e-10
    )
    cosine = (4.16666666666666019037e-02 + z * -1.38888888888741095749e-03) + w * (
        (2.48015872894767294178e-05 + z * -2.75573143513906633035e-07)
        + w * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)
    )
    sine = r + r * z * (z * sine - 1.66666666666666324348e-01)
    cosine = 1.0 - (0.5 * z - w * cosine)
    return _quarter_turn(whole + quarters, sine, cosine)


@overload(math.cos, strict=False)
def _cos(x: Any) -> Any:
    return (lambda x: _sine_beyond(x, 1.0)) if x is lanes else None


@overload(math.sin, strict=False)
def _sin(x: Any) -> Any:
    return (lambda x: _sine_beyond(x, 0.0)) if x is lanes else None
