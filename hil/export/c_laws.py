"""Compiled laws of the catalogue, translated from their Python source to C: types, expressions, functions."""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
import typing
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

from estimator import lanes
from estimator.physics.kernel.rates import under_own
from estimator.signals.record import FloatArray

Type = Any
"""``float``, ``int``, ``bool``, a NamedTuple's class, ``FloatArray``, or a tuple of types for several values."""

OF_ANY = tuple[Any, ...]
"""What is known when a simulation is compiled only, as a user's own laws: an exported model has none."""

PRELUDE = """\
#include <math.h>

typedef struct { double *at; int size; } Array;

static double lesser(double a, double b) { return b < a ? b : a; }
static double greater(double a, double b) { return b > a ? b : a; }
"""
_SCALARS = {float: "double", int: "int", bool: "int", FloatArray: "Array"}
_SHORT = {float: "d", int: "i", bool: "b"}

INDENT = "    "

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
_TRANSPARENT = (lanes.every, lanes.some, lanes.broadcast_as, lanes.borrowed, np.asarray, under_own)
"""Functions that return their first argument where there is one number only, and no law of a user's own."""


def is_record(kind: Type) -> bool:
    """Tell whether a type is a NamedTuple's."""
    return isinstance(kind, type) and hasattr(kind, "_fields")


def fields(kind: Type) -> dict[str, Type]:
    """Return names and types of what a NamedTuple or several values hold."""
    if is_record(kind):
        hints = typing.get_type_hints(kind)
        return {name: of_hint(hints[name]) for name in kind._fields if hints[name] != OF_ANY}
    return {f"item{i}": each for i, each in enumerate(kind)}


def c_name(kind: Type) -> str:
    """Return the name of a type in C."""
    if isinstance(kind, tuple):
        return "Several_" + "".join(_SHORT.get(each) or c_name(each) for each in kind)
    if is_record(kind):
        return str(kind.__name__)
    return _SCALARS[kind]


def definition(kind: Type) -> str:
    """Return the C text that defines a structure."""
    members = " ".join(f"{c_name(each)} {name};" for name, each in fields(kind).items())
    return f"typedef struct {{ {members} }} {c_name(kind)};"


def of_hint(hint: Any) -> Type:
    """Return the type that an annotation means."""
    if hint == FloatArray:  # typing hands out copies
        return FloatArray
    return tuple(typing.get_args(hint)) if typing.get_origin(hint) is tuple else hint


class Translation:
    """A C file that grows by the functions that are asked for."""

    def __init__(self) -> None:
        self._names: dict[Any, tuple[str, Type]] = {}
        self._structures: dict[Type, str] = {}
        self._functions: list[str] = []

    def function(self, function: Callable[..., Any], of_one_number: bool = False) -> tuple[str, Type]:
        """Translate a function, where it has not been, and return its name in C and the type it returns."""
        source = getattr(function, "py_func", function)
        if source not in self._names:
            module = source.__module__.rsplit(".", 1)[-1]
            name = f"{module}_{source.__name__}".replace("__", "_")
            translated = _Function(self, source, name, of_one_number)
            self._names[source] = name, translated.returned
            self._functions.append(translated.c())
        return self._names[source]

    def structure(self, kind: Type) -> None:
        """Define a structure, and those in it, where they have not been."""
        if kind in self._structures:
            return
        for each in fields(kind).values():
            if each not in (float, int, bool, FloatArray):
                self.structure(each)
        self._structures[kind] = definition(kind)

    def text(self) -> str:
        """Return the C source: structures, then functions, each before what calls it."""
        return "\n".join((PRELUDE, *self._structures.values(), "", *self._functions))


class _Function:
    """One function on its way to C."""

    def __init__(self, unit: Translation, function: Callable[..., Any], name: str, of_one_number: bool) -> None:
        self._unit, self._name = unit, name
        self._node = _parsed(function)
        hints = {key: of_hint(hint) for key, hint in typing.get_type_hints(function).items()}
        if of_one_number:
            hints = {key: float if hint is FloatArray else hint for key, hint in hints.items()}
        self.returned = hints.pop("return")
        self._given = {each.arg: hints[each.arg] for each in self._node.args.args}
        self._names = dict(self._given)
        where = f"{inspect.getsourcefile(function)}, {function.__name__}"
        self._of = Expressions(unit, function.__globals__, self._names, where, of_one_number)
        self._temporaries = 0
        for kind in (*self._given.values(), self.returned):
            if kind not in (float, int, bool, FloatArray, type(None)):
                unit.structure(kind)

    def c(self) -> str:
        body = self._block(self._node.body, 1)
        own = {name: kind for name, kind in self._names.items() if name not in self._given}
        declared = [f"{INDENT}{c_name(kind)} {name};" for name, kind in own.items()]
        given = ", ".join(f"{c_name(kind)} {name}" for name, kind in self._given.items())
        returned = "void" if self.returned is type(None) else c_name(self.returned)
        return "\n".join((f"static {returned} {self._name}({given}) {{", *declared, *body, "}", ""))

    def _block(self, nodes: list[ast.stmt], depth: int) -> list[str]:
        return [line for node in nodes for line in self._statement(node, depth)]

    def _statement(self, node: ast.stmt, depth: int) -> list[str]:
        pad = INDENT * depth
        match node:
            case ast.Expr(ast.Constant(str())):
                return []
            case ast.Return(ast.expr() as value):
                return [f"{pad}return {self._of.text(value)[0]};"]
            case ast.Assign([target], value) | ast.AnnAssign(target, _, ast.expr() as value):
                return [pad + line for line in self._assigned(target, value)]
            case ast.AugAssign(target, operator, value):
                return [pad + line for line in self._assigned(target, ast.BinOp(_read(target), operator, value))]
            case ast.If(test, body, orelse):
                otherwise = [f"{pad}}} else {{", *self._block(orelse, depth + 1)] if orelse else []
                opening = f"{pad}if ({self._of.text(test)[0]}) {{"
                return [opening, *self._block(body, depth + 1), *otherwise, f"{pad}}}"]
            case ast.While(test, body, []):
                return [f"{pad}while ({self._of.text(test)[0]}) {{", *self._block(body, depth + 1), f"{pad}}}"]
            case ast.For(ast.Name(name), ast.Call(ast.Name("range"), [last]), body, []):
                self._names[name] = int
                opening = f"{pad}for ({name} = 0; {name} < {self._of.text(last)[0]}; {name}++) {{"
                return [opening, *self._block(body, depth + 1), f"{pad}}}"]
            case ast.Continue():
                return [f"{pad}continue;"]
            case _:
                raise self._of.refused(node)

    def _assigned(self, target: ast.expr, value: ast.expr) -> list[str]:
        """Return the lines that set one variable or, all at a time, several."""
        if not isinstance(target, ast.Tuple):
            return [self._set(target, self._of.text(value))]
        if isinstance(value, ast.Tuple) and len(value.elts) == len(target.elts):
            parts = [self._of.text(each) for each in value.elts]
            kept = [self._temporary(part) for part in parts]
        else:
            whole = self._temporary(self._of.text(value))
            kept = [whole]
            parts = [(f"{whole[1]}.{name}", kind) for name, kind in fields(whole[2]).items()]
            return [whole[0], *(self._set(each, part) for each, part in zip(target.elts, parts, strict=True))]
        held = [(name, kind) for _, name, kind in kept]
        settings = [self._set(each, part) for each, part in zip(target.elts, held, strict=True)]
        return [*(line for line, _, _ in kept), *settings]

    def _temporary(self, part: Text) -> tuple[str, str, Type]:
        text, kind = part
        self._temporaries += 1
        name = f"held{self._temporaries}"
        self._names[name] = kind
        return f"{name} = {text};", name, kind

    def _set(self, target: ast.expr, part: Text) -> str:
        text, kind = part
        if isinstance(target, ast.Subscript):
            return f"{self._of.text(_read(target))[0]} = {text};"
        if not isinstance(target, ast.Name):
            raise self._of.refused(target)
        known = self._names.get(target.id, kind)
        self._names[target.id] = kind if known is kind or target.id == "_" else _wider(known, kind)
        return f"{target.id} = {text};"


def _wider(one: Type, other: Type) -> Type:
    """Return the type of a variable that is set from both: a number that may have a fraction."""
    if one == other:
        return one
    if {one, other} <= {float, int, bool}:
        return float
    raise NotTranslatable(f"expected one type for a variable, got {c_name(one)} and {c_name(other)}")


def _read(target: ast.expr) -> ast.expr:
    """Return the expression that reads what a target sets."""
    return ast.parse(ast.unparse(target), mode="eval").body


def _parsed(function: Callable[..., Any]) -> ast.FunctionDef:
    node = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    if not isinstance(node, ast.FunctionDef):
        raise NotTranslatable(f"expected a function, got {function!r}")
    return node


Text = tuple[str, Type]
"""C text and its type."""


class NotTranslatable(ValueError):
    """A law uses what has no counterpart here; the message names the file, the line and what it is."""


class Expressions:
    """Translates expressions in the scope of one function."""

    def __init__(
        self, unit: Translation, scope: dict[str, Any], names: dict[str, Type], where: str, of_one_number: bool
    ) -> None:
        self._unit, self._scope, self.names, self._where = unit, scope, names, where
        self._of_one_number = of_one_number  # and so is whatever is called

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
        name, kind = self._unit.function(function, self._of_one_number)
        return f"{name}({arguments})", kind
