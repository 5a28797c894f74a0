"""Compiled functions as C: each with what it calls, in an order in which C can read them."""

from __future__ import annotations

import ast
import inspect
import textwrap
import typing
from collections.abc import Callable
from typing import Any

from estimator.physics.kernel.declared import SUMS, Sum
from estimator.signals.record import FloatArray
from hil.export.c.expressions import Expressions, NotTranslatable, Text
from hil.export.c.types import PRELUDE, Type, c_name, definition, fields, of_hint

INDENT = "    "


class Translation:
    """A C file that grows by the functions that are asked for."""

    def __init__(self) -> None:
        self._names: dict[Any, tuple[str, Type]] = {}
        self._structures: dict[Type, str] = {}
        self._functions: list[str] = []

    def function(self, function: Callable[..., Any], of_one_number: bool = False) -> tuple[str, Type]:
        """Translate a function, where it has not been, and return its name in C and the type it returns."""
        if function in SUMS:
            return self._sum(SUMS[function])
        source = getattr(function, "py_func", function)
        if source not in self._names:
            module = source.__module__.rsplit(".", 1)[-1]
            name = f"{module}_{source.__name__}".replace("__", "_")
            translated = _Function(self, source, name, of_one_number)
            self._names[source] = name, translated.returned
            self._functions.append(translated.c())
        return self._names[source]

    def _sum(self, of: Sum) -> tuple[str, Type]:
        """Write a sum of laws, where it has not been."""
        if of not in self._names:
            given = [f"given{i}" for i in range(of.given)]
            terms = [
                f"{self.function(law)[0]}({', '.join([*given, *(f'p.at[{place}]' for place in places)])})"
                for law, places in of.terms
            ]
            name = f"laws_{of.place.name.lower()}"
            arguments = ", ".join([*(f"double {each}" for each in given), "Array p"])
            total = " + ".join(["0.0", *terms])
            self._functions.append(f"static double {name}({arguments}) {{\n{INDENT}return {total};\n}}\n")
            self._names[of] = name, float
        return self._names[of]

    def structure(self, kind: Type) -> None:
        """Define a structure, and those in it, where they have not been."""
        if kind in self._structures:
            return
        for each in fields(kind).values():
            if each not in (float, int, bool, FloatArray):
                self.structure(each)
        self._structures[kind] = definition(kind)

    def text(self) -> str:
        """Return the C text."""
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
        self._of = Expressions(unit, function.__globals__, self._names, where)
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
