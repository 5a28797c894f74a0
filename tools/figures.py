"""``python tools/figures.py [COMMIT ...]``: how much is explained, at each commit and in the files as they are.

Counts for product code (`hil`, `drivers`, `estimator`): files and lines, lines of docstrings and of comments, public
functions and fields without a word, constants below the first function or class, public names with several meanings in
one package; the words of the manual; and the figures of the estimator's core (`core.py`).
"""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import tarfile
import tempfile
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from core import core_figures

ROOT = Path(__file__).parent.parent
PACKAGES = ("hil", "drivers", "estimator")
Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


def main() -> int:
    """Write a row for each figure, a column for each commit and one for the working copy."""
    columns = {}
    for commit in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as folder:
            packed = subprocess.run(["git", "archive", commit], cwd=ROOT, capture_output=True, check=True).stdout
            tarfile.open(fileobj=io.BytesIO(packed)).extractall(folder, filter="data")
            columns[commit[:12]] = figures(Path(folder))
    columns["now"] = figures(ROOT)
    sys.stdout.write(f"| | {' | '.join(columns)} |\n|{' --- |' * (len(columns) + 1)}\n")
    for name in columns["now"]:
        sys.stdout.write(f"| {name} | {' | '.join(column[name] for column in columns.values())} |\n")
    return 0


def figures(root: Path) -> dict[str, str]:
    """Return all figures of a copy of the project, by name."""
    paths = [path for package in PACKAGES for path in sorted((root / package).rglob("*.py"))]
    sources = {path.relative_to(root): path.read_text("utf-8") for path in paths}
    trees = {path: ast.parse(text) for path, text in sources.items()}
    n_lines = sum(text.count("\n") for text in sources.values())
    comments = sum(map(_comments, sources.values()))
    found = {
        "files": f"{len(trees)}",
        "lines": f"{n_lines}",
        "lines of docstrings": f"{sum(map(_docstring_lines, trees.values()))}",
        "lines with a comment": f"{comments} ({comments / n_lines:.1%})",
        "constants below the first definition": f"{sum(map(_low_constants, trees.values()))}",
    }
    for package in PACKAGES:
        of = [(sources[path], tree) for path, tree in trees.items() if path.parts[0] == package]
        functions = [bool(ast.get_docstring(each)) for _, tree in of for each in _public(tree)]
        fields = [True for _, tree in of for _ in _fields(tree)]
        missing = [each for text, tree in of for each in unexplained_fields(tree, text.splitlines())]
        found[f"{package}: public functions without docstring"] = _share(functions)
        found[f"{package}: fields without a word"] = _share([False] * len(missing) + fields[len(missing) :])
    meanings = _meanings(trees)
    found["public classes of one name in one package"] = f"{sum(1 for n in meanings.values() if n > 1)}"
    found |= core_figures(trees, {path: text.count("\n") for path, text in sources.items()})
    pages = [*(root / "docs").rglob("*.md"), *root.glob("*.md")]
    found["words of the manual"] = f"{sum(len(page.read_text('utf-8').split()) for page in pages)}"
    return found


def _share(explained: list[bool]) -> str:
    missing = explained.count(False)
    return f"{missing} of {len(explained)} ({missing / max(len(explained), 1):.0%})"


def _comments(text: str) -> int:
    return sum(each.type == tokenize.COMMENT for each in tokenize.generate_tokens(io.StringIO(text).readline))


def _docstring_lines(tree: ast.Module) -> int:
    texts = (
        each.value for each in ast.walk(tree) if isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant)
    )
    return sum(each.end_lineno - each.lineno + 1 for each in texts if isinstance(each.value, str) and each.end_lineno)


def _low_constants(tree: ast.Module) -> int:
    first = next((i for i, node in enumerate(tree.body) if isinstance(node, Definition)), len(tree.body))
    return sum(_constant(node) for node in tree.body[first:])


def _constant(node: ast.stmt) -> bool:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return any(isinstance(each, ast.Name) and each.id.lstrip("_").isupper() for each in targets)


def _public(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Yield public functions and public methods of public classes."""
    for node in tree.body:
        inside = node.body if isinstance(node, ast.ClassDef) and not node.name.startswith("_") else []
        for each in (node, *inside):
            if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef) and not each.name.startswith("_"):
                yield each


def _fields(tree: ast.Module) -> Iterator[tuple[ast.ClassDef, ast.AnnAssign, ast.stmt | None]]:
    """Yield the fields of public dataclasses and named tuples: class, field, and what stands below it."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            marks = [ast.unparse(each) for each in (*node.decorator_list, *node.bases)]
            if any("dataclass" in mark or mark == "NamedTuple" for mark in marks):
                for field, below in zip(node.body, [*node.body[1:], None], strict=True):
                    if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
                        yield node, field, below


def unexplained_fields(tree: ast.Module, lines: list[str]) -> Iterator[ast.AnnAssign]:
    """Yield the fields that no comment, no docstring below them and no docstring of their class explains."""
    for node, field, after in _fields(tree):
        name, text = ast.unparse(field.target), ast.get_docstring(node) or ""
        own = "#" in "".join(lines[field.lineno - 1 : field.end_lineno])
        above = lines[field.lineno - 2].strip().startswith("#")
        below = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        inside = f"`{name}`" in text or f"{name} :" in text or f", {name} :" in text
        if not (own or above or below or inside):
            yield field


def _meanings(trees: dict[Path, ast.Module]) -> dict[tuple[str, str], int]:
    """Return how many public classes and aliases there are of a name, by package and name."""
    found: dict[tuple[str, str], int] = defaultdict(int)
    for path, tree in trees.items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[path.parts[0], node.name] += 1
    return found


if __name__ == "__main__":
    sys.exit(main())
