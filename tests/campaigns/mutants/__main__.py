"""``python -m tests.campaigns.mutants [--module M] [--every N]``: does a test notice each small change of the guard?

Each mutant is tried in a process forked from one that has the libraries loaded and none of this program: the changed
source takes the module's place when it is imported. Prints the mutants that live and are not listed, exits 1 if any.
"""

import argparse
import importlib
import importlib.abc
import importlib.machinery
import os
import signal
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

from tests.campaigns.mutants.changes import mutants
from tests.campaigns.mutants.targets import TARGETS, Target

ROOT = Path(__file__).resolve().parents[3]
LOADED = ("pytest", "hypothesis", "numpy", "can", "canopen", "pydantic", "pymodbus.client")
"""Libraries that tests use: loaded once."""

TIMEOUT_S = 120
"""A mutant that hangs is found."""


class _Mutated(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives a changed source in the place of a module."""

    def __init__(self, name: str, source: str) -> None:
        self._name = name
        self._source = source

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != self._name:
            return None
        return importlib.machinery.ModuleSpec(fullname, self, origin=str(source_of(fullname)))

    def exec_module(self, module: ModuleType) -> None:
        exec(compile(self._source, f"<mutant of {self._name}>", "exec"), module.__dict__)


def source_of(module: str) -> Path:
    """Give the file of a module."""
    return ROOT / (module.replace(".", "/") + ".py")


def lives(module: str, source: str, tests: Sequence[str]) -> bool:
    """Whether every test passes with this source in a module's place."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            status = _try(module, source, tests)
        finally:
            os._exit(status)
    _, ended = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(ended) == 0


def _try(module: str, source: str, tests: Sequence[str]) -> int:
    import pytest

    signal.alarm(TIMEOUT_S)
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    sys.meta_path.insert(0, _Mutated(module, source))
    os.chdir(ROOT)
    arguments = [
        "-x",
        "-n",
        "0",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:randomly",
        "-m",
        "not campaign",
        "-W",
        "ignore::pytest.PytestAssertRewriteWarning",
    ]
    return int(pytest.main([*arguments, *tests]))


def survivors(module: str, target: Target, every: int = 1) -> tuple[int, int]:
    """Try mutants of one module; give how many there were, and how many live and are not listed, each printed."""
    chosen = list(mutants(source_of(module).read_text("utf-8")))[::every]
    living = 0
    for mutant in chosen:
        if mutant.change not in target.equivalent and lives(module, mutant.source, target.tests):
            living += 1
            print(f"{source_of(module).relative_to(ROOT)}:{mutant.line}: {mutant.change}", flush=True)
    return len(chosen), living


def main(arguments: list[str] | None = None) -> int:
    """Run the campaign."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.mutants")
    parser.add_argument("--module", action="append", choices=TARGETS)
    parser.add_argument("--every", type=int, default=1, help="Try one in N.")
    asked = parser.parse_args(arguments)
    for library in LOADED:
        importlib.import_module(library)
    tried = found = 0
    for module in asked.module or TARGETS:
        target = TARGETS[module]
        if not lives(module, source_of(module).read_text("utf-8"), target.tests):
            raise SystemExit(f"{module}: its tests fail without a change, so that they show nothing")
        count, living = survivors(module, target, asked.every)
        tried, found = tried + count, found + living
        print(f"{module}: {count} mutants, {living} live unlisted, {len(target.equivalent)} listed", flush=True)
    print(f"{tried} mutants, {found} live unlisted")
    return int(found > 0)


if __name__ == "__main__":
    sys.exit(main())
