"""Figures of the estimator's core, counted from its source: how far a reader has to go, and which numbers decide.

*The way of a diagnosis* is that of a reader who begins at ``diagnose`` and reads each function where it is first named,
to its end, before the next one: a call, a function handed over, a property, a method. A method is found by the class
that a parameter is annotated with, or by its name where nothing else of the estimator, of Python or of NumPy has it. A
*return* is a step back into a file that was left before. Files and returns are those of ``estimator/diagnosis``; what
it calls outside is not followed.

*A number that decides* is one that something is compared with or bounded by (a comparison, ``min``, ``max``, ``clip``):
a named constant that holds numbers, or a number written there, other than 0, 1, 2, a half, and what keeps a
logarithm finite. Those in the files for thresholds and priors are where they belong; the others are counted.
"""

from __future__ import annotations

import ast
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from itertools import groupby
from pathlib import Path

import numpy as np

ROOM, START = "estimator.diagnosis", ("estimator.diagnosis.diagnose", "diagnose")
WATCHED = ("inference.search", "inference.hypotheses", "diagnose")  # files that are to be entered a few times each
GATHERED = ("thresholds", "priors")  # files whose numbers are where they belong
BOUNDING = frozenset({"min", "max", "clip", "minimum", "maximum"})
PLAIN = (0, 1, 2, 0.5)  # numbers that are no choice
GUARD = 1e-9  # numbers up to here keep a logarithm or a division finite
USUAL = {name for of in (np.ndarray, np.random.Generator, Path, str, dict, list, set, int) for name in dir(of)}

Key = tuple[str, str]
"""A module, and the name of a function, class or method in it."""


def core_figures(trees: Mapping[Path, ast.Module], lines: Mapping[Path, int]) -> dict[str, str]:
    """Return the figures of the core, by name, from syntax trees and lengths of all files, by path from the root."""
    of_estimator = ((path, tree) for path, tree in trees.items() if path.parts[0] == "estimator")
    way = Way({".".join(path.with_suffix("").parts): tree for path, tree in of_estimator})
    entered = Counter(way.files())
    rooms = [path for path in trees if path.parts[:2] in (("estimator", "diagnosis"), ("estimator", "physics"))]
    numbers = deciding({path: tree for path, tree in trees.items() if path.parts[:2] == ("estimator", "diagnosis")})
    return {
        "core: files from recording to verdict": f"{len(entered)}",
        "core: returns on that way": f"{entered.total() - len(entered)}",
        f"core: times entered, {', '.join(WATCHED)}": ", ".join(f"{entered[f'{ROOM}.{name}']}" for name in WATCHED),
        "core: lines of estimator/diagnosis and physics": f"{sum(lines[path] for path in rooms)}",
        "core: numbers that decide outside of the files for them": f"{numbers.total()} in {len(numbers)} files",
    }


class Way:
    """The way of a reader through the functions of the room."""

    def __init__(self, modules: Mapping[str, ast.Module]) -> None:
        self._nodes: dict[Key, ast.FunctionDef | ast.ClassDef] = {}
        self._names: dict[str, dict[str, Key]] = defaultdict(dict)  # what a name in a module stands for
        self._methods: dict[str, list[Key]] = defaultdict(list)  # of the room, by name
        for module, tree in modules.items():
            for node in tree.body:
                self._learn(module, node)
        self._usual = USUAL | set(_fields(modules.values()))  # names by which no method is found
        self._order: list[Key] = []

    def files(self) -> list[str]:
        """Return the modules in the order in which the reader enters them."""
        if not self._order:
            self._read(START)
        return [module for module, _ in groupby(module for module, _ in self._order)]

    def _learn(self, module: str, node: ast.stmt) -> None:
        if isinstance(node, ast.ImportFrom) and node.module:
            self._names[module] |= {each.asname or each.name: (node.module, each.name) for each in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            self._nodes[module, node.name] = node
            self._names[module][node.name] = (module, node.name)
            for each in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(each, ast.FunctionDef):
                    key = module, f"{node.name}.{each.name}"
                    self._nodes[key] = each
                    if module.startswith(ROOM):
                        self._methods[each.name].append(key)

    def _read(self, key: Key) -> None:
        node = self._nodes.get(key)
        if node is None or key in self._order or not key[0].startswith(ROOM):
            return
        if isinstance(node, ast.ClassDef):
            for name in ("__init__", "__post_init__"):
                self._read((key[0], f"{key[1]}.{name}"))
            return
        self._order.append(key)
        for each in _uses(node):
            found = self._found(each, *key)
            if found is not None:
                self._read(found)

    def _found(self, use: ast.Name | ast.Attribute, module: str, within: str) -> Key | None:
        if isinstance(use, ast.Name):
            return self._resolved(module, use.id)
        if isinstance(use.value, ast.Name):
            of = self._owner(use.value.id, module, within)
            inside = ".".join(self._names[module].get(use.value.id, ("", "")))
            for key in (None if of is None else (of[0], f"{of[1]}.{use.attr}"), self._resolved(inside, use.attr)):
                if key in self._nodes:
                    return key
            if of is not None:  # a field
                return None
        same = [] if use.attr in self._usual else self._methods[use.attr]
        return same[0] if len(same) == 1 else None

    def _owner(self, name: str, module: str, within: str) -> Key | None:
        """Return the class that a name stands for an instance of, or that it is itself."""
        if name in ("self", "cls"):
            return module, within.partition(".")[0]
        node = self._nodes[module, within]
        arguments = [*node.args.args, *node.args.kwonlyargs] if isinstance(node, ast.FunctionDef) else []
        noted = next((each.annotation for each in arguments if each.arg == name), None)
        if noted is not None:  # X, or X | None
            noted = noted.left if isinstance(noted, ast.BinOp) else noted
            name = noted.id if isinstance(noted, ast.Name) else ""
        return self._resolved(module, name)

    def _resolved(self, module: str, name: str) -> Key | None:
        """Return what a name stands for, through re-exports; None for what is no function or class of the project."""
        seen: set[Key] = set()
        key = self._names[module].get(name)
        while key is not None and key not in self._nodes and key not in seen:
            seen.add(key)
            key = self._names[key[0]].get(key[1])
        return key if key in self._nodes else None


def _fields(trees: Iterable[ast.Module]) -> Iterator[str]:
    """Yield the names of all fields of classes."""
    for tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                yield from (ast.unparse(each.target) for each in node.body if isinstance(each, ast.AnnAssign))


def _uses(node: ast.FunctionDef) -> list[ast.Name | ast.Attribute]:
    """Return what a function's body names, in the order in which it is read; the innermost call first."""
    found = [
        each
        for statement in node.body
        for each in ast.walk(statement)
        if isinstance(each, ast.Name | ast.Attribute) and isinstance(each.ctx, ast.Load)
    ]
    return sorted(found, key=lambda each: (each.end_lineno or 0, each.end_col_offset or 0))


def deciding(trees: Mapping[Path, ast.Module]) -> Counter[str]:
    """Return how many numbers decide in each module of the room, by its name; none where there are none."""
    modules = {".".join(path.with_suffix("").parts): tree for path, tree in trees.items()}
    named = {(module, name) for module, tree in modules.items() for name in _named_numbers(tree)}
    used: set[Key] = set()
    written: Counter[str] = Counter()
    for module, tree in modules.items():
        imported = {
            each.asname or each.name: (node.module, each.name)
            for node in tree.body
            if isinstance(node, ast.ImportFrom) and node.module
            for each in node.names
        }
        for each in _compared(tree):
            if isinstance(each, ast.Name):
                used |= {(module, each.id), imported.get(each.id, (module, each.id))} & named
            elif isinstance(each, ast.Constant) and type(each.value) in (int, float):
                written[module] += each.value not in PLAIN and each.value > GUARD
    found = written + Counter(module for module, _ in used)
    return Counter({module: count for module, count in found.items() if module.rpartition(".")[2] not in GATHERED})


def _named_numbers(tree: ast.Module) -> Iterator[str]:
    for node in tree.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            numbers = (each for each in ast.walk(node.value) if isinstance(each, ast.Constant))
            if any(type(each.value) in (int, float) for each in numbers):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                names = (each for target in targets for each in ast.walk(target) if isinstance(each, ast.Name))
                yield from (each.id for each in names if each.id.lstrip("_").isupper())


def _compared(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield all that stands in a comparison or is given to a function that bounds."""
    seen: set[int] = set()
    for node in ast.walk(tree):
        parts: list[ast.expr] = []
        if isinstance(node, ast.Compare):
            parts = [node]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name | ast.Attribute):
            name = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            parts = node.args if name in BOUNDING else []
        for each in (inner for part in parts for inner in ast.walk(part)):
            if id(each) not in seen:
                seen.add(id(each))
                yield each
