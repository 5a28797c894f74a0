"""What Python and its ``math`` do with numbers, done with lanes."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir

from estimator.lanes.tools import defined_once, lower_builtin, signature, type_callable, types
from estimator.lanes.types import LANES, NUMBERS, LanesType, MaskType, lanes, mask

Make = Callable[..., Any]
"""From an instruction builder and the arguments' values to the result's."""

FUSED = ("contract",)
"""A product and the sum it goes into may be one instruction, rounded once."""

NUMBER = (LanesType, types.Number)
ANSWER = (MaskType, types.Boolean)


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
    """Return what one of LLVM's own functions makes of lanes."""
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
