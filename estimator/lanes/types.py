"""The types that compiled code has for numbers, for yes and no, and for rows of numbers in lanes."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import extending
from numba.core import cgutils as core_cgutils, datamodel, typeconv, types as core_types, typing

types: Any = core_types
cgutils: Any = core_cgutils
PrimitiveModel: Any = datamodel.models.PrimitiveModel
Conversion: Any = vars(typeconv)["Conversion"]
signature: Any = vars(typing)["signature"]
defined_once: Any = core_cgutils.get_or_insert_function
intrinsic: Any = extending.intrinsic
overload: Any = extending.overload
type_callable: Any = extending.type_callable
lower_builtin: Any = extending.lower_builtin
lower_cast: Any = extending.lower_cast
register_jitable: Any = extending.register_jitable
register_model: Any = extending.register_model


LANES = 8  # numbers in lanes: one register of the widest instructions there are today, two or four of others

NUMBERS = ir.VectorType(ir.DoubleType(), LANES)
BITS = ir.VectorType(ir.IntType(64), LANES)
YES_OR_NO = ir.VectorType(ir.IntType(1), LANES)
ADDRESS = ir.IntType(8).as_pointer()


class LanesType(types.Type):
    """Numbers in lanes. A single number is one of it that is the same in every lane."""

    def __init__(self) -> None:
        super().__init__("Lanes")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """Let numba take a plain number for one in every lane."""
        return Conversion.safe if isinstance(other, types.Number) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Be what a variable is that is a single number elsewhere."""
        return self if isinstance(other, types.Number) else None


class MaskType(types.Type):
    """Yes or no for each of the lanes."""

    def __init__(self) -> None:
        super().__init__("Mask")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """Take any yes or no."""
        return Conversion.safe if isinstance(other, types.Boolean) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Be what a variable is that is a single yes or no elsewhere."""
        return self if isinstance(other, types.Boolean) else None


class ColumnsType(types.Type):
    """An array's rows as lanes. Unlike the array it counts no references, which would cost more than a law."""

    def __init__(self) -> None:
        super().__init__("Columns")


lanes, mask, columns = LanesType(), MaskType(), ColumnsType()


@register_model(LanesType)
class _LanesModel(PrimitiveModel):
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, NUMBERS)


@register_model(MaskType)
class _MaskModel(PrimitiveModel):
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, YES_OR_NO)


@register_model(ColumnsType)
class _ColumnsModel(PrimitiveModel):
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, ADDRESS)


def _in_every_lane(builder: Any, value: Any, vector: Any) -> Any:
    nothing = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))


@lower_cast(types.Number, lanes)
def _number_in_every_lane(context: Any, builder: Any, got: Any, wanted: Any, value: Any) -> Any:
    return _in_every_lane(builder, context.cast(builder, value, got, types.float64), NUMBERS)


@lower_cast(types.Boolean, mask)
def _answer_in_every_lane(context: Any, builder: Any, got: Any, wanted: Any, value: Any) -> Any:
    return _in_every_lane(builder, value, YES_OR_NO)
