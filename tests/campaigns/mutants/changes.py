"""Mutants of a module: one small change each, of the kinds a person makes by mistake."""

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass

_COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}

_OPERATIONS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.Pow: ast.Mult,
}

_FUNCTIONS = {"min": "max", "max": "min", "any": "all", "all": "any"}


@dataclass(frozen=True)
class Mutant:
    """A changed module."""

    line: int
    change: str
    source: str


def mutants(source: str) -> Iterator[Mutant]:
    """Make every mutant of a module's source; texts, types, and where a class keeps its attributes are left alone."""
    tree = ast.parse(source)
    seen: dict[str, int] = {}
    slots = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.keyword) and node.arg == "slots"}
    for place, node in enumerate(ast.walk(tree)):
        for new in _changed(node) if id(node) not in slots else ():
            mutated = copy.deepcopy(tree)
            target = list(ast.walk(mutated))[place]
            was = ast.unparse(node)
            _replace(mutated, target, new)
            change = f"{was} -> {ast.unparse(new)}"
            seen[change] = seen.get(change, 0) + 1
            number = "" if seen[change] == 1 else f" #{seen[change]}"
            line = getattr(node, "lineno", 0)
            yield Mutant(line, change + number, ast.unparse(ast.fix_missing_locations(mutated)))


def _changed(node: ast.AST) -> Iterator[ast.expr]:  # noqa: C901 - a table
    match node:
        case ast.Compare(ops=operators):
            for k, operator in enumerate(operators):
                for other in _COMPARISONS[type(operator)]:
                    changed = copy.deepcopy(node)
                    changed.ops[k] = other()
                    yield changed
        case ast.BinOp(op=operator) if type(operator) in _OPERATIONS and not _is_text_or_type(node):
            changed = copy.deepcopy(node)
            changed.op = _OPERATIONS[type(operator)]()
            yield changed
        case ast.BoolOp(op=operator):
            changed = copy.deepcopy(node)
            changed.op = ast.And() if isinstance(operator, ast.Or) else ast.Or()
            yield changed
        case ast.UnaryOp(op=ast.Not() | ast.USub() | ast.Invert(), operand=operand):
            yield copy.deepcopy(operand)
        case ast.Constant(value=bool() as value):
            yield ast.Constant(not value)
        case ast.Constant(value=int() | float() as value):
            yield ast.Constant(value + 1)
        case ast.Call(func=ast.Name(id="abs"), args=[argument]):
            yield copy.deepcopy(argument)
        case ast.Call(func=ast.Name(id=name)) if name in _FUNCTIONS:
            changed = copy.deepcopy(node)
            changed.func = ast.Name(_FUNCTIONS[name])
            yield changed
        case ast.IfExp(test=test, body=body, orelse=orelse):
            yield ast.IfExp(copy.deepcopy(test), copy.deepcopy(orelse), copy.deepcopy(body))


def _is_text_or_type(node: ast.BinOp) -> bool:
    """Whether it joins texts, or names a union of types."""
    parts = (node.left, node.right)
    return any(isinstance(part, ast.JoinedStr | ast.Constant) and not _is_number(part) for part in parts) or any(
        isinstance(part, ast.Name) and part.id in ("int", "float", "str", "bytes") for part in parts
    )


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float)


def _replace(tree: ast.AST, target: ast.AST, new: ast.expr) -> None:
    for parent in ast.walk(tree):
        for name, value in ast.iter_fields(parent):
            if value is target:
                setattr(parent, name, new)
                return
            if isinstance(value, list):
                for k, each in enumerate(value):
                    if each is target:
                        value[k] = new
                        return
