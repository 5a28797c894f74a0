"""Functions written as text, from what a table declares."""

from __future__ import annotations

import linecache
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from estimator.compiled import assembled

Scope = Mapping[str, object]
"""What a text may name, and the ``__name__`` of the module that it belongs to."""


def written(
    name: str, given: Mapping[str, object], returned: object, body: Iterable[str], scope: Scope
) -> Callable[..., Any]:
    """Return the function of some lines of Python about its arguments and what the scope names.

    It is compiled into whatever calls it. An error shows its text, and ``inspect.getsource`` gives it, types and all,
    for who translates it.
    """
    head = ", ".join(f"{each}: of_{each}" for each in given)
    lines = [f"def {name}({head}) -> of_return:", *(f"    {line}" for line in body)]
    file, text = f"<{scope['__name__']}: {name}>", "\n".join(lines) + "\n"
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file
    names: dict[str, Any] = {**scope, **{f"of_{each}": kind for each, kind in given.items()}, "of_return": returned}
    exec(compile(text, file, "exec"), names)  # no text of a stranger: that of a module of the kernel
    made: Callable[..., Any] = assembled(names[name])
    return made


def several(parts: Iterable[str]) -> str:
    """Return the text of a tuple."""
    return f"({''.join(f'{part}, ' for part in parts).strip()})"
