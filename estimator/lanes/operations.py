"""What laws may do with a number, or with one in each of several SIMD lanes: decisions, arithmetic, functions.

``if`` asks one question. Lanes give an answer each: ``choose`` takes of two values, both worked out, the one each lane
asks for; ``every`` and ``some`` tell whether anything has to be worked out at all.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir

from estimator.lanes.types import (
    BITS,
    LANES,
    NUMBERS,
    LanesType,
    MaskType,
    defined_once,
    intrinsic,
    lanes,
    lower_builtin,
    mask,
    overload,
    register_jitable,
    signature,
    type_callable,
    types,
)

FUSED = ("contract",)  # a product and the sum it goes into may be one instruction, rounded once

NUMBER = (LanesType, types.Number)
ANSWER = (MaskType, types.Boolean)

LARGEST = 708.0  # beyond this the exponential leaves the range of a number; it stays at its end

LOG2_E = 1.4426950408889634
LN_2, LN_2_HIGH, LN_2_LOW = 0.6931471805599453, 6.93147180369123816490e-01, 1.90821492927058770002e-10
WHOLE = 6755399441055744.0  # added to a number, ``1.5 * 2**52`` leaves its whole part in the last bits

TWO_BY_PI = 0.6366197723675814
QUARTER_HIGH, QUARTER_MIDDLE = 1.57079632673412561417e00, 6.07710050630396597660e-11
QUARTER_LOW = 2.02226624879595063154e-21
"""Parts of a quarter turn; times a whole number up to a million the first two are exact."""

_BITS_OF_WHOLE = 0x4338000000000000
_BITS_OF_HALF_OCTAVE = 0x3FE6A09E667F3BCD
_MANTISSA_BITS, _EXPONENT_OF_1 = 52, 1023


def choose(condition: bool, value: float, other: float) -> float:
    """Return ``value`` where a condition holds, ``other`` where not."""
    return value if condition else other


def every(condition: bool) -> bool:
    """Tell whether a condition holds in every lane; of a single number, whether it holds."""
    return condition


def some(condition: bool) -> bool:
    """Tell whether a condition holds in some lane; of a single number, whether it holds."""
    return condition


def broadcast_as(value: float, other: float) -> float:
    """Return a single number, in every lane where ``other`` has lanes."""
    return value


@intrinsic
def _chosen(typingctx: Any, condition: Any, value: Any, other: Any) -> Any:
    def made(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(*args)

    return lanes(mask, lanes, lanes), made


def _as_one_number(builder: Any, answers: Any) -> Any:
    return builder.bitcast(answers, ir.IntType(LANES))


@intrinsic
def _every(typingctx: Any, condition: Any) -> Any:
    def made(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.icmp_unsigned("==", _as_one_number(builder, args[0]), ir.IntType(LANES)(2**LANES - 1))

    return types.boolean(mask), made


@intrinsic
def _some(typingctx: Any, condition: Any) -> Any:
    def made(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.icmp_unsigned("!=", _as_one_number(builder, args[0]), ir.IntType(LANES)(0))

    return types.boolean(mask), made


@intrinsic
def _in_lanes(typingctx: Any, value: Any) -> Any:
    def made(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return args[0]

    return lanes(lanes), made


@overload(choose, strict=False)
def _choose(condition: Any, value: Any, other: Any) -> Any:
    if isinstance(condition, MaskType):
        return lambda condition, value, other: _chosen(condition, value, other)
    return lambda condition, value, other: value if condition else other


@overload(every, strict=False)
def _every_of(condition: Any) -> Any:
    if isinstance(condition, MaskType):
        return lambda condition: _every(condition)
    return lambda condition: condition


@overload(some, strict=False)
def _some_of(condition: Any) -> Any:
    if isinstance(condition, MaskType):
        return lambda condition: _some(condition)
    return lambda condition: condition


@overload(broadcast_as, strict=False)
def _like(value: Any, other: Any) -> Any:
    if other is lanes:
        return lambda value, other: _in_lanes(value)
    return lambda value, other: value


Make = Callable[..., Any]
"""From an instruction builder and the arguments' values to the result's."""


def define(function: Any, kinds: tuple[type, ...], wanted: Any, result: Any, make: Make) -> None:
    """Define a function of one or two arguments, of which one at least is ``wanted`` and all are of some ``kinds``."""
    count = make.__code__.co_argcount - 1

    def typed(*args: Any) -> Any:
        if wanted in args and all(isinstance(arg, kinds) for arg in args):
            return signature(result, *(count * (wanted,)))
        return None

    # numba reads off the arguments' names how many there are
    type_callable(function)(lambda context: (lambda x: typed(x)) if count == 1 else (lambda x, y: typed(x, y)))

    @lower_builtin(function, *(count * (wanted,)))
    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return make(builder, *args)


def called(builder: Any, name: str, *args: Any) -> Any:
    """Call LLVM's intrinsic of this name on all lanes at once."""
    kind = ir.FunctionType(NUMBERS, [NUMBERS] * len(args))
    return builder.call(defined_once(builder.module, kind, f"llvm.{name}.v{LANES}f64"), args)


def _define_numbers(function: Any, make: Make) -> None:
    define(function, NUMBER, lanes, lanes, make)


def _define_comparison(function: Any, sign: str) -> None:
    define(function, NUMBER, lanes, mask, lambda builder, x, y: builder.fcmp_ordered(sign, x, y))


def _smaller(builder: Any, x: Any, y: Any) -> Any:
    return builder.select(builder.fcmp_ordered("<", y, x), y, x)


def _larger(builder: Any, x: Any, y: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", y, x), y, x)


for _function in (operator.add, operator.iadd):
    _define_numbers(_function, lambda builder, x, y: builder.fadd(x, y, flags=FUSED))
for _function in (operator.sub, operator.isub):
    _define_numbers(_function, lambda builder, x, y: builder.fsub(x, y, flags=FUSED))
for _function in (operator.mul, operator.imul):
    _define_numbers(_function, lambda builder, x, y: builder.fmul(x, y, flags=FUSED))
for _function in (operator.truediv, operator.itruediv):
    _define_numbers(_function, lambda builder, x, y: builder.fdiv(x, y))
_define_numbers(operator.neg, lambda builder, x: builder.fneg(x))
_define_numbers(abs, lambda builder, x: called(builder, "fabs", x))
_define_numbers(float, lambda builder, x: x)
_define_numbers(math.sqrt, lambda builder, x: called(builder, "sqrt", x))
_define_numbers(math.copysign, lambda builder, x, y: called(builder, "copysign", x, y))
_define_numbers(min, _smaller)
_define_numbers(max, _larger)

for _function, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _define_comparison(_function, _sign)
define(operator.ne, NUMBER, lanes, mask, lambda builder, x, y: builder.fcmp_unordered("!=", x, y))
define(operator.and_, ANSWER, mask, mask, lambda builder, x, y: builder.and_(x, y))
define(operator.or_, ANSWER, mask, mask, lambda builder, x, y: builder.or_(x, y))


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
