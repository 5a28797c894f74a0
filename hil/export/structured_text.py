"""Prints a project as IEC 61131-3 Structured Text.

The tests execute the text that is printed here and compare it with `estimator` to the bit.
"""

from __future__ import annotations

from collections.abc import Iterator
from textwrap import indent
from typing import Final

from hil.export.pou import Array, DataType, Pou, Project, Section, Variable

NUMBERS_PER_LINE: Final = 4

_RULER: Final = "=" * 92


def structured_text(project: Project) -> str:
    """Return the whole text: head, data types, POUs; ready to import into a PLC project."""
    parts = (_title(project.comment), *map(_type, project.types), *map(_pou, project.pous))
    return "\n".join(parts)


def _title(comment: str) -> str:
    return f"(* {_RULER}\n{indent(comment, '   ')}\n   {_RULER} *)\n"


def _type(kind: DataType) -> str:
    return f"TYPE\n    {kind.name} : {_type_text(kind.array)};    (* {kind.comment} *)\nEND_TYPE\n"


def _pou(pou: Pou) -> str:
    sections = "\n".join(map(_section, pou.sections))
    kind = pou.kind.value
    return f"{_title(pou.comment)}{kind} {pou.name}\n{sections}\n\n{pou.body}\nEND_{kind}\n"


def _section(section: Section) -> str:
    keyword = f"{section.kind.value} CONSTANT" if section.constant else section.kind.value
    comment = f"    (* {section.comment} *)" if section.comment else ""
    return "\n".join((keyword + comment, *_declarations(section.variables), "END_VAR"))


def _declarations(variables: tuple[Variable, ...]) -> Iterator[str]:
    """Yield the declarations, colons and comments one below the other."""
    width = max(len(variable.name) for variable in variables)
    texts = [_declaration(variable, width) for variable in variables]
    column = max(len(text.splitlines()[-1]) for text in texts) + 4
    for variable, text in zip(variables, texts, strict=True):
        yield f"{text}{_comment(variable.comment, column, text.splitlines()[-1])}"


def _declaration(variable: Variable, width: int) -> str:
    initial = _initial(variable)
    return f"    {variable.name:<{width}} : {_type_text(variable.type)}{initial and f' := {initial}'};"


def _comment(comment: str, column: int, after: str) -> str:
    if not comment:
        return ""
    first, *rest = comment.splitlines()
    lines = (f"(* {first}", *(" " * (column + 3) + line for line in rest))
    return " " * (column - len(after)) + "\n".join(lines) + " *)"


def _type_text(kind: str | Array) -> str:
    if isinstance(kind, str):
        return kind
    bounds = ", ".join(f"{low}..{high}" for low, high in kind.bounds)
    return f"ARRAY[{bounds}] OF {kind.element}"


def _initial(variable: Variable) -> str:
    if not isinstance(variable.type, Array):
        return "".join(variable.initial)
    starts = range(0, len(variable.initial), NUMBERS_PER_LINE)
    rows = ("        " + ", ".join(variable.initial[start : start + NUMBERS_PER_LINE]) for start in starts)
    return "[\n" + ",\n".join(rows) + "]" if variable.initial else ""
