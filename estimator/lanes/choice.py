"""Which way to go, of one number or of many in lanes.

``if`` asks one question. Lanes give an answer each: ``choose`` takes of two values, both worked out, the one each lane
asks for; ``every`` and ``some`` tell whether anything has to be worked out at all.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir

from estimator.lanes.tools import intrinsic, overload, types
from estimator.lanes.types import LANES, MaskType, lanes, mask


def choose(condition: bool, value: float, other: float) -> float:
    """Return ``value`` where a condition holds, ``other`` where not."""
    return value if condition else other


def every(condition: bool) -> bool:
    """Tell whether a condition holds in every lane; of a single number, whether it holds."""
    return condition


def some(condition: bool) -> bool:
    """Tell whether a condition holds in some lane; of a single number, whether it holds."""
    return condition


def like(value: float, other: float) -> float:
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


@overload(like, strict=False)
def _like(value: Any, other: Any) -> Any:
    if other is lanes:
        return lambda value, other: _in_lanes(value)
    return lambda value, other: value
