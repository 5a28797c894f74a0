"""An expression of a compiled law as C text, with its type."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from estimator import lanes
from estimator.physics.kernel.rates import under_own
from estimator.signals.record import FloatArray
from hil.export.c.types import Type, c_name, fields, is_record

if TYPE_CHECKING:
    from hil.export.c.translation import Translation

Text = tuple[str, Type]
"""C text and its type."""

_OPERATORS = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==",
    ast.NotEq: "!=", ast.BitAnd: "&", ast.BitOr: "|",
}  # fmt: skip
_CONSTANTS = {math.inf: "INFINITY", -math.inf: "-INFINITY"}
_OF_MATH = ("sin", "cos", "exp", "expm1", "log", "sqrt", "copysign", "ceil")
_FUNCTIONS: dict[Any, str] = {
    **{getattr(module, name): name for module in (math, np) for name in _OF_MATH},
    **dict.fromkeys((abs, np.abs), "fabs"),
    **dict.fromkeys((min, np.minimum), "lesser"),
    **dict.fromkeys((max, np.maximum), "greater"),
}
_TRANSPARENT = (lanes.every, lanes.some, lanes.like, lanes.borrowed, np.asarray, under_own)
"""Functions that return their first argument where there is one number only, and no law of a user's own."""


class NotTranslatable(ValueError):
    """A law uses what has no counterpart here; the message names the file, the line and what it is."""


class Expressions:
    """Translates expressions in the scope of one function.

    Parameters
    ----------
    unit : Translation
        Where the functions and structures that they use are asked for.
    scope : dict
        The function's globals.
    names : dict of str to type
        Local variables.
    where : str
        The function's file and name, for messages.
    """

    def __init__(self, unit: Translation, scope: dict[str, Any], names: dict[str, Type], where: str) -> None:
        self._unit, self._scope, self.names, self._where = unit, scope, names, where

    def refused(self, node: ast.AST) -> NotTranslatable:
        """Return the error that names what can't be translated."""
        got = ast.unparse(node).splitlines()[0]
        return NotTranslatable(f"{self._where}: expected what C can be written for, got {got!r}")

    def text(self, node: ast.expr) -> Text:
        """Return C text and type of an expression."""
        known = self._constant(node)
        if known is not None:
            return known
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise self.refused(node)
        made: Text = method(node)
        return made

    def _value(self, node: ast.expr) -> Any:
        """Return what a name of a module stands for; None for a local variable or a computed value."""
        if isinstance(node, ast.Name):
            builtins = {each.__name__: each for each in (abs, min, max, float, bool, int)}
            return None if node.id in self.names else self._scope.get(node.id, builtins.get(node.id))
        if isinstance(node, ast.Attribute):
            owner = self._value(node.value)
            return getattr(owner, node.attr, None) if isinstance(owner, ModuleType) else None
        return node.value if isinstance(node, ast.Constant) else None

    def _constant(self, node: ast.expr) -> Text | None:
        value = self._value(node)
        if isinstance(value, bool | int):
            return str(int(value)), type(value)
        if isinstance(value, float):
            return _CONSTANTS.get(value) or repr(float(value)), float
        return None

    def _name(self, node: ast.Name) -> Text:
        if node.id not in self.names:
            raise self.refused(node)
        return node.id, self.names[node.id]

    def _attribute(self, node: ast.Attribute) -> Text:
        owner, kind = self.text(node.value)
        if kind is FloatArray and node.attr == "size":
            return f"{owner}.size", int
        if not is_record(kind):
            raise self.refused(node)
        return f"{owner}.{node.attr}", fields(kind)[node.attr]

    def _subscript(self, node: ast.Subscript) -> Text:
        owner, kind = self.text(node.value)
        if isinstance(kind, tuple) and isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, int):
            return f"{owner}.item{node.slice.value}", kind[node.slice.value]
        if kind is not FloatArray:
            raise self.refused(node)
        return f"{owner}.at[{self.text(node.slice)[0]}]", float

    def _binop(self, node: ast.BinOp) -> Text:
        (left, a), (right, b) = self.text(node.left), self.text(node.right)
        kind = a if a is b else float
        if isinstance(node.op, ast.Div):
            return f"({left} / {right})" if float in (a, b) else f"((double){left} / {right})", float
        if isinstance(node.op, ast.Pow):
            return (f"({left} * {left})" if right == "2" else f"pow({left}, {right})"), float
        return f"({left} {self._operator(node.op, node)} {right})", kind

    def _operator(self, operator: ast.AST, node: ast.AST) -> str:
        sign = _OPERATORS.get(type(operator))
        if sign is None:
            raise self.refused(node)
        return str(sign)

    def _unaryop(self, node: ast.UnaryOp) -> Text:
        value, kind = self.text(node.operand)
        return (f"(!{value})", bool) if isinstance(node.op, ast.Not) else (f"(-{value})", kind)

    def _compare(self, node: ast.Compare) -> Text:
        operands = [self.text(each)[0] for each in (node.left, *node.comparators)]
        pairs = zip(operands[:-1], node.ops, operands[1:], strict=True)
        return "(" + " && ".join(f"({a} {self._operator(op, node)} {b})" for a, op, b in pairs) + ")", bool

    def _boolop(self, node: ast.BoolOp) -> Text:
        sign = " && " if isinstance(node.op, ast.And) else " || "
        return "(" + sign.join(self.text(each)[0] for each in node.values) + ")", bool

    def _ifexp(self, node: ast.IfExp) -> Text:
        return self._choice(node.test, node.body, node.orelse)

    def _choice(self, condition: ast.expr, value: ast.expr, other: ast.expr) -> Text:
        (yes, kind), (no, another) = self.text(value), self.text(other)
        return f"({self.text(condition)[0]} ? {yes} : {no})", kind if kind is another else float

    def _tuple(self, node: ast.Tuple) -> Text:
        parts = self.parts(node.elts)
        return self._made(tuple(kind for _, kind in parts), parts)

    def parts(self, nodes: list[ast.expr]) -> list[Text]:
        """Return several expressions, where ``*several`` stands for what it holds."""
        out: list[Text] = []
        for node in nodes:
            if not isinstance(node, ast.Starred):
                out.append(self.text(node))
                continue
            owner, kind = self.text(node.value)
            out += [(f"{owner}.{name}", each) for name, each in fields(kind).items()]
        return out

    def _made(self, kind: Type, parts: list[Text]) -> Text:
        self._unit.structure(kind)
        return f"({c_name(kind)}){{{', '.join(text for text, _ in parts)}}}", kind

    def _call(self, node: ast.Call) -> Text:
        function = self._value(node.func)
        if node.keywords or function is None:
            raise self.refused(node)
        if function in (lanes.choose, np.where):
            return self._choice(*node.args)
        if function in _TRANSPARENT:
            return self.text(node.args[0])
        parts = self.parts(node.args)
        arguments = ", ".join(text for text, _ in parts)
        if function in (float, bool):
            return f"(({c_name(function)})({arguments}))", function
        if function is math.floor:
            return f"((int)floor({arguments}))", int
        if function is np.isfinite:
            return f"(isfinite({arguments}) != 0)", bool
        if function is np.clip:
            value, low, high = (text for text, _ in parts)
            return f"lesser(greater({value}, {low}), {high})", float
        if function in _FUNCTIONS:
            return f"{_FUNCTIONS[function]}({arguments})", float
        if is_record(function):
            return self._made(function, parts)
        return self._called(function, arguments, node)

    def _called(self, function: Callable[..., Any], arguments: str, node: ast.Call) -> Text:
        if not callable(function) or not getattr(function, "__module__", "").startswith("estimator."):
            raise self.refused(node)
        name, kind = self._unit.function(function)
        return f"{name}({arguments})", kind
