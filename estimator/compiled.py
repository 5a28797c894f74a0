"""One way to compile: numba with a disk cache that a changed law can't outlive.

numba keys its cache by the file of the outermost function alone, so a kernel would keep using the old code of a law
that lives in another file. Here the cache folder carries the digest of every source file next to which code is
compiled. Folders of other versions are removed when nobody uses them any more (`estimator.kernel_cache`).
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import config as numba_config

from estimator.kernel_cache import take
from estimator.undisturbed import compile_undisturbed

Function = TypeVar("Function", bound=Callable[..., Any])


PACKAGES = ("lanes", "signals", "identification", "physics", "diagnosis/line")
"""Packages that hold compiled code, or constants that it freezes."""


def _digest() -> str:
    digest = hashlib.sha256(numba.__version__.encode() + Path(__file__).read_bytes())  # how, and below, what
    for package in PACKAGES:
        for path in sorted((Path(__file__).parent / package).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> Path:
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hil"
    return Path(os.environ.get("NUMBA_CACHE_DIR") or cache) / f"kernel-{_digest()}"


vars(numba_config)["CACHE_DIR"] = str(_cache_folder())  # numba defines its settings at run time

compile_undisturbed()

IS_COMPILED = not vars(numba_config)["DISABLE_JIT"]
"""Whether code is compiled, and not run by Python, for a debugger, because of ``NUMBA_DISABLE_JIT``."""

if IS_COMPILED:
    take(_cache_folder())


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


def brief(function: Function) -> Function:
    """Compile a function that is over in microseconds and is called all the time: it keeps the interpreter lock."""
    return cast(Function, numba.njit(cache=True, error_model="numpy")(function))
