"""The tree of a text: what a function block declares and what it does, typed."""

from __future__ import annotations

from dataclasses import dataclass, field

REALS = ("LREAL", "REAL")
INTEGERS = ("INT", "DINT")


@dataclass(frozen=True, slots=True)
class Variable:
    """A declared variable; ``type`` is an elementary type or a function block; ``bounds`` those of an array."""

    name: str
    type: str
    bounds: tuple[tuple[int, int], ...] = ()
    initial: tuple[str, ...] = ()  # literals in C's spelling
    constant: bool = False
    is_input: bool = False


@dataclass(frozen=True, slots=True)
class Expression:
    """C text of an expression and the type it has in Structured Text; literals of integers have type ``int``."""

    c: str
    type: str


@dataclass(frozen=True, slots=True)
class Assign:
    target: Expression
    value: Expression


@dataclass(frozen=True, slots=True)
class Call:
    instance: Variable
    inputs: tuple[tuple[str, Expression], ...]


@dataclass(frozen=True, slots=True)
class If:
    branches: tuple[tuple[Expression | None, tuple[Statement, ...]], ...]


@dataclass(frozen=True, slots=True)
class For:
    counter: str
    first: Expression
    last: Expression
    step: int
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Exit:
    pass


Statement = Assign | Call | If | For | Exit


@dataclass(slots=True)
class Block:
    """A function block."""

    name: str
    variables: dict[str, Variable] = field(default_factory=dict)  # by name in small letters: ST tells no case
    body: tuple[Statement, ...] = ()
