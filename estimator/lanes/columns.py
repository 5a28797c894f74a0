"""An array's rows as lanes."""

from __future__ import annotations

import operator
from typing import Any, TypeVar

from estimator.lanes.types import (
    ADDRESS,
    LANES,
    NUMBERS,
    ColumnsType,
    cgutils,
    columns,
    intrinsic,
    lanes,
    lower_builtin,
    overload,
    signature,
    type_callable,
    types,
)

Borrowed = TypeVar("Borrowed")

BYTES = 8


def borrowed(array: Borrowed) -> Borrowed:
    """Return an array without its owner, who keeps it until compiled code is done with it; of Python, the array."""
    return array


@intrinsic
def _without_owner(typingctx: Any, array: Any) -> Any:
    def made(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        owner = context.data_model_manager[array].get_field_position("meminfo")
        nobody = cgutils.get_null_value(args[0].type.elements[owner])
        return builder.insert_value(args[0], nobody, owner)

    return array(array), made


@overload(borrowed, strict=False)
def _borrowed(array: Any) -> Any:
    if isinstance(array, types.Array):
        return lambda array: _without_owner(array)
    return None


@intrinsic
def as_lanes(typingctx: Any, array: Any) -> Any:
    """Return the rows of an array (n, LANES) to be read and set as lanes; whoever uses them keeps the array."""
    if not (isinstance(array, types.Array) and array.layout == "C" and array.ndim == 2):
        return None

    def made(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.bitcast(context.make_array(sig.args[0])(context, builder, args[0]).data, ADDRESS)

    return columns(array), made


def _row(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    index = context.cast(builder, args[1], sig.args[1], types.intp)
    start = builder.gep(args[0], [builder.mul(index, index.type(BYTES * LANES))])
    return builder.bitcast(start, NUMBERS.as_pointer())


@type_callable(operator.getitem)
def _read(context: Any) -> Any:
    def typer(rows: Any, index: Any) -> Any:
        if isinstance(rows, ColumnsType) and isinstance(index, types.Integer):
            return signature(lanes, rows, index)
        return None

    return typer


@lower_builtin(operator.getitem, columns, types.Integer)
def _get(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.load(_row(context, builder, sig, args), align=BYTES)


@type_callable(operator.setitem)
def _written(context: Any) -> Any:
    def typer(rows: Any, index: Any, value: Any) -> Any:
        if isinstance(rows, ColumnsType) and isinstance(index, types.Integer):
            return signature(types.none, rows, index, lanes)
        return None

    return typer


@lower_builtin(operator.setitem, columns, types.Integer, lanes)
def _set(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    builder.store(args[2], _row(context, builder, sig, args), align=BYTES)
    return context.get_dummy_value()
