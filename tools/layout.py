"""``python tools/layout.py``: what of a file's order a program can check, in the product and in the tools.

A module is imported by one statement and under one name; no file imports or mentions itself, as files that were joined
do; a constant stands above what uses it. That the docstring names the whole file is for a reader to see.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
ROOMS = ("hil", "drivers", "estimator", "tools")
UNDER_WORK = "estimator/diagnosis/"  # constants stay where they are until its rewriting is done; then this line goes

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
    if UNDER_WORK not in path.as_posix():
        yield from _late_constants(tree)
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


def _late_constants(tree: ast.Module) -> Iterator[Finding]:
    """Yield constants that are used in a function or class above them, and that could stand there."""
    used_at: dict[str, int] = {}
    bound_at: dict[str, int] = {}
    for node in tree.body:
        needs = max((bound_at.get(each.id, 0) for each in ast.walk(node) if isinstance(each, ast.Name)), default=0)
        bound_at |= dict.fromkeys([*_targets(node), getattr(node, "name", "")], node.lineno)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            for each in ast.walk(node):
                if isinstance(each, ast.Name):
                    used_at.setdefault(each.id, node.lineno)
        for target in _targets(node):
            if target.lstrip("_").isupper() and target in used_at and needs < used_at[target]:
                yield node.lineno, f"{target} stands below what uses it (line {used_at[target]}): move it up"


def _targets(node: ast.stmt) -> list[str]:
    """Return the names that an assignment binds."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return [each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)]


if __name__ == "__main__":
    sys.exit(main())
