"""One way to compile: numba with a disk cache that a changed law can't outlive, and that an unchanged one outlives.

numba keys its cache by the path, the time and the lines of the file of the outermost function. So a kernel would keep
using the old code of a law that lives in another file, and a word in a docstring would compile everything anew. Here
the folder of a compiled function carries a digest of the sources that it can depend on: its module and, through their
imports, all others of this project, without comments and docstrings. A kernel is compiled again when code changed that
it may contain, and only then, wherever the project lies. Folders that nobody uses are removed
(`estimator.kernel_cache`).
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Self, TypeVar, cast

import numba
from numba.core import config as numba_config
from numba.core.caching import _CacheLocator

from estimator.kernel_cache import take
from estimator.undisturbed import compile_undisturbed

Function = TypeVar("Function", bound=Callable[..., Any])

ROOT = Path(__file__).parent.parent
"""Folder of the packages whose imports are followed."""

_IMPORT = re.compile(
    r"^[ \t]*(?:from ((?:estimator|hil)\b[\w.]*) import (\([^)]*\)|.*)|import ((?:estimator|hil)\b[\w.]*))", re.M
)
_NO_CODE = re.compile(r'^[ \t]*r?"""[\s\S]*?"""[ \t]*$|^[ \t]*#.*$|(?<=\S)  # .*$', re.M)
"""Docstrings and comments: what is compiled is the same without them."""

IS_COMPILED = not vars(numba_config)["DISABLE_JIT"]
"""Whether code is compiled, and not run by Python, for a debugger, because of ``NUMBA_DISABLE_JIT``."""


@cache
def _code(path: Path) -> str:
    """Return a source file without its comments and docstrings, nor the empty lines where they were."""
    lines = _NO_CODE.sub("", path.read_text("utf-8")).splitlines()
    return "\n".join(line for line in lines if line.strip())


@cache
def _imports(path: Path) -> frozenset[Path]:
    """Return the project's source files that a file imports, at its head or inside a function."""
    found = set()
    for package, names, module in _IMPORT.findall(_code(path)):
        place = ROOT.joinpath(*(package or module).split("."))
        for candidate in (place, *(place / name for name in re.findall(r"\w+", names))):
            for file in (candidate.with_suffix(".py"), candidate / "__init__.py"):
                if file.is_file():
                    found.add(file)
    return frozenset(found)


@cache
def _sources(path: Path) -> frozenset[Path]:
    """Return a source file and all of the project's that it imports, directly or through others."""
    found, open_ = {path}, [path]
    while open_:
        new = _imports(open_.pop()) - found
        found |= new
        open_ += new
    return frozenset(found)


@cache
def cache_folder(path: Path) -> Path:
    """Return the folder that holds what was compiled of a source file [Path], and take it for this process."""
    digest = hashlib.sha256(numba.__version__.encode() + _code(Path(__file__)).encode())  # how, and below, what
    for code in sorted(_code(source) for source in _sources(path)):
        digest.update(code.encode())
    digest.update(path.stem.encode())
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hil"
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or base) / f"kernel-{digest.hexdigest()[:16]}"
    take(folder)
    return folder


class SourceLocator(_CacheLocator):
    """Tells numba where it keeps a function of a source file: in the folder of the sources that it depends on."""

    def __init__(self, path: Path) -> None:
        self._path = path

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> Self | None:
        """Return the place of a function of a file; None where its source is in no file."""
        return cls(Path(py_file)) if Path(py_file).is_file() else None

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(cache_folder(self._path))

    def get_source_stamp(self) -> str:
        """Return nothing that changes: the folder's name tells of the sources."""
        return ""

    def get_disambiguator(self) -> str:
        """Return nothing that changes with the lines above a function: numba compares the code itself."""
        return ""


_settings = vars(numba_config)
if "NUMBA_OPT" not in os.environ:  # at the third level a simulation takes as long, and a fifth more to compile
    _settings["OPT"] = type(_settings["OPT"])(2)
_settings["CACHE_LOCATOR_CLASSES"] = f"{SourceLocator.__module__}.{SourceLocator.__name__}"

compile_undisturbed()


def compiled(function: Function) -> Function:
    """Compile a function to machine code without the interpreter lock; cached on disk."""
    return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def inlined(function: Function) -> Function:
    """Compile a function into whatever calls it: what is constant there is worked out once, and no call is left."""
    return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(function))


def ir_inlined(function: Function) -> Function:
    """Compile a function as a part of each compiled one that calls it, and never by itself.

    What calls a kernel takes the kernel's whole code in and works on it anew. Where several small functions stand in
    between, each would; so they are inlined before anything is compiled.
    """
    return cast(Function, numba.njit(nogil=True, error_model="numpy", inline="always")(function))


def assembled(function: Function) -> Function:
    """Compile a function put together from others into whatever calls it, and cached with that: it has no file."""
    return cast(Function, numba.njit(nogil=True, error_model="numpy", forceinline=True)(function))


def compiled_with_lock(function: Function) -> Function:
    """Compile a function that is over in microseconds and is called all the time: it keeps the interpreter lock."""
    return cast(Function, numba.njit(cache=True, error_model="numpy")(function))
