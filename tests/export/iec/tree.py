"""The tree of a text: what a function block or a program declares and what it does, typed."""

from __future__ import annotations

from dataclasses import dataclass, field

REALS = ("LREAL", "REAL")
INTEGERS = ("INT", "DINT")
ELEMENTARY = ("BOOL", *INTEGERS, *REALS)


@dataclass(frozen=True, slots=True)
class Shape:
    """A type: an elementary one or a function block, or an array of the former under a name, or under none ('')."""

    element: str
    bounds: tuple[tuple[int, int], ...] = ()
    name: str = ""

    @property
    def size(self) -> int:
        """Number of elements."""
        found = 1
        for low, high in self.bounds:
            found *= high - low + 1
        return found


@dataclass(frozen=True, slots=True)
class Variable:
    """A declared variable; ``section`` is the keyword it stands under."""

    name: str
    shape: Shape
    section: str = "VAR"
    constant: bool = False
    initial: tuple[str, ...] = ()  # literals in C's spelling


@dataclass(frozen=True, slots=True)
class Expression:
    """C text of an expression and its type in Structured Text; literals have type ``int`` or ``real``.

    ``literal`` is the value of a literal integer, with its sign.
    """

    c: str
    type: str
    literal: int | None = None


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
class While:
    condition: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Exit:
    pass


Statement = Assign | Call | If | For | While | Exit


@dataclass(slots=True)
class Block:
    """A function block or a program."""

    name: str
    is_program: bool = False
    variables: dict[str, Variable] = field(default_factory=dict)  # by name in small letters: ST tells no case
    body: tuple[Statement, ...] = ()
