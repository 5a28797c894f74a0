"""``python tools/layout.py``: what of a file's order a program can check, in the product and in the tools.

A module is imported by one statement and under one name; no file imports or mentions itself, as files that were joined
do; constants stand above the first definition; fields of public records in estimator and drivers are explained. That
the docstring names the whole file is for a reader to see.
"""

from __future__ import annotations

import ast
import builtins
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from figures import unexplained_fields

ROOT = Path(__file__).parent.parent
ROOMS = ("hil", "drivers", "estimator", "tools")
EXPLAINED = ("drivers", "estimator", "hil")  # where every field has a comment or a docstring
DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)

Finding = tuple[int, str]
"""Line, and what is wrong there."""


def main() -> int:
    """Write a line for each finding; return 1 if there are any."""
    lines = [
        f"{path.relative_to(ROOT)}:{line}: {what}\n"
        for room in ROOMS
        for path in sorted((ROOT / room).rglob("*.py"))
        for line, what in sorted(findings(path))
    ]
    sys.stdout.writelines(lines)
    return 1 if lines else 0


def findings(path: Path) -> Iterator[Finding]:
    """Yield what is wrong in a file."""
    text = path.read_text("utf-8")
    tree = ast.parse(text)
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    yield from _imports(tree, name, path.name == "__init__.py")
    for node in late_constants(tree):
        yield node.lineno, f"{_targets(node)[0]} stands below the first definition: move it above"
    if name.partition(".")[0] in EXPLAINED:
        for node in unexplained_fields(tree, text.splitlines()):
            yield node.lineno, f"{ast.unparse(node.target)} has no word: say its unit, shape and meaning in a comment"
    if path.name != "__init__.py":
        for number, line in enumerate(text.splitlines(), start=1):
            if f"`{name}`" in line or f"`{path.relative_to(ROOT)}`" in line:
                yield number, f"mentions itself, {name}: was it joined from others? Say it without the name"


def _imports(tree: ast.Module, name: str, is_package: bool) -> Iterator[Finding]:
    """Yield modules that are imported twice at the head, under two names, or by themselves."""
    statements = Counter(node.module for node in tree.body if isinstance(node, ast.ImportFrom) and not node.level)
    names: dict[str, set[str]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == name and not is_package:
            yield node.lineno, "imports itself"
        if isinstance(node, ast.ImportFrom) and node in tree.body and statements[node.module] > 1:
            yield node.lineno, f"{node.module} is imported by {statements[node.module]} statements: make it one"
        for module, known_as in _names(node):
            names.setdefault(module, set()).add(known_as)
            if len(names[module]) > 1:
                yield node.lineno, f"{module} is known by {' and '.join(sorted(names[module]))}: give it one name"


def _names(node: ast.AST) -> Iterator[tuple[str, str]]:
    """Yield what an import statement binds: full name of a module or of a name in one, and what it is called here."""
    if isinstance(node, ast.Import):
        yield from ((alias.name, alias.asname or alias.name) for alias in node.names)
    if isinstance(node, ast.ImportFrom) and not node.level:
        yield from ((f"{node.module}.{alias.name}", alias.asname or alias.name) for alias in node.names)


def late_constants(tree: ast.Module) -> Iterator[ast.Assign | ast.AnnAssign]:
    """Yield constants below the first function or class that could stand above it: they need nothing from below it."""
    first = next((i for i, node in enumerate(tree.body) if isinstance(node, DEFINITIONS)), len(tree.body))
    filled = {each for node in tree.body[first:] for each in _filled(node)}
    known = ({each for node in tree.body[:first] for each in _bound(node)} | set(dir(builtins))) - filled
    for node in tree.body[first:]:
        targets = _targets(node)
        if targets and all(map(_is_constant, targets)) and isinstance(node, ast.Assign | ast.AnnAssign) and node.value:
            names = [each for each in ast.walk(node.value) if isinstance(each, ast.Name)]
            own = {each.id for each in names if isinstance(each.ctx, ast.Store)}  # of a comprehension
            if {each.id for each in names} - own <= known:
                known.update(set(targets) - filled)
                yield node


def _bound(node: ast.stmt) -> Iterator[str]:
    """Yield the names that a statement of the head binds: imports, assignments, also those behind a condition."""
    for each in ast.walk(node):
        if isinstance(each, ast.Import | ast.ImportFrom):
            yield from ((alias.asname or alias.name).partition(".")[0] for alias in each.names)
        if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store):
            yield each.id


def _filled(node: ast.stmt) -> Iterator[str]:
    """Yield the names that a loop or a call at the end of a file changes: what is made of them has to stay below it."""
    if not isinstance(node, (*DEFINITIONS, ast.AnnAssign)) and not _targets(node):
        yield from (each.id for each in ast.walk(node) if isinstance(each, ast.Name))


def _is_constant(name: str) -> bool:
    return name.lstrip("_").isupper()


def _targets(node: ast.stmt) -> list[str]:
    """Return the names that an assignment binds."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    names = [each for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)]
    return [each.id for each in names if isinstance(each.ctx, ast.Store)]


if __name__ == "__main__":
    sys.exit(main())
