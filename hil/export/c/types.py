"""What a value of a compiled law is, and what it is called in C."""

from __future__ import annotations

import typing
from typing import Any

from estimator.signals.record import FloatArray

Type = Any
"""``float``, ``int``, ``bool``, a NamedTuple's class, ``FloatArray``, or a tuple of types for several values."""

OF_ANY = tuple[Any, ...]
"""What is known when a simulation is compiled only, as a user's own laws: an exported model has none."""

PRELUDE = """\
#include <math.h>

typedef struct { double *at; int size; } Array;

static double lesser(double a, double b) { return b < a ? b : a; }
static double greater(double a, double b) { return b > a ? b : a; }
"""
_SCALARS = {float: "double", int: "int", bool: "int", FloatArray: "Array"}
_SHORT = {float: "d", int: "i", bool: "b"}


def is_record(kind: Type) -> bool:
    """Tell whether a type is a NamedTuple's."""
    return isinstance(kind, type) and hasattr(kind, "_fields")


def fields(kind: Type) -> dict[str, Type]:
    """Return names and types of what a NamedTuple or several values hold."""
    if is_record(kind):
        hints = typing.get_type_hints(kind)
        return {name: hints[name] for name in kind._fields if hints[name] != OF_ANY}
    return {f"item{i}": each for i, each in enumerate(kind)}


def c_name(kind: Type) -> str:
    """Return the name of a type in C."""
    if isinstance(kind, tuple):
        return "Several_" + "".join(_SHORT.get(each) or c_name(each) for each in kind)
    if is_record(kind):
        return str(kind.__name__)
    return _SCALARS[kind]


def definition(kind: Type) -> str:
    """Return the C text that defines a structure."""
    members = " ".join(f"{c_name(each)} {name};" for name, each in fields(kind).items())
    return f"typedef struct {{ {members} }} {c_name(kind)};"


def of_hint(hint: Any) -> Type:
    """Return the type that an annotation means."""
    if hint == FloatArray:  # typing hands out copies
        return FloatArray
    return tuple(typing.get_args(hint)) if typing.get_origin(hint) is tuple else hint
