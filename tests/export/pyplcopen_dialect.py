"""A project in the part of Structured Text that the compiler of ``pyplcopen`` takes.

What it has not got, and the standard has: unnamed array types, constants in function blocks, calls that leave out an
input, and a name that is declared in two POUs (it puts the bodies of the blocks that are called into one program).
Statements and expressions stay as they are, but for the names.
"""

import re
from collections.abc import Iterator

from hil.export.plcopen import Array, Pou, Project, Section, SectionKind, Variable

CALL = re.compile(r"\b(?P<instance>\w+)\((?P<inputs>\w+ := [^;]*)\);")
MEMBER = re.compile(r"\b(?P<instance>[A-Za-z]\w*)\.(?P<member>\w+)")
NAME = re.compile(r"(?<![\w@])[A-Za-z]\w*")

NOTHING = {"BOOL": "FALSE", "INT": "0", "DINT": "0", "LREAL": "0.0", "REAL": "0.0"}


def in_dialect(project: Project) -> str:
    """Return the whole text."""
    named = (f"TYPE\n{kind.name} : {_array(kind.array)};\nEND_TYPE" for kind in project.types)
    pous = {pou.name: pou for pou in project.pous}
    return "\n".join((*named, *(each for pou in project.pous for each in _pou(pou, pous)), ""))


def _pou(pou: Pou, pous: dict[str, Pou]) -> Iterator[str]:
    for variable in _variables(pou):
        if isinstance(variable.type, Array):
            yield f"TYPE\n{_type(variable, pou)} : {_array(variable.type)};\nEND_TYPE"
    yield f"{pou.kind.value} {pou.name}"
    for section in pou.sections:
        yield from _section(section, pou)
    yield f"{_Body(pou, pous).text()}\nEND_{pou.kind.value}"


def _section(section: Section, pou: Pou) -> Iterator[str]:
    yield section.kind.value
    for variable in section.variables:
        values = ", ".join(variable.initial)
        initial = f" := {f'[{values}]' if isinstance(variable.type, Array) else values}" if values else ""
        yield f"{variable.name}_{pou.name} : {_type(variable, pou)}{initial};"
    yield "END_VAR"


def _variables(pou: Pou) -> Iterator[Variable]:
    for section in pou.sections:
        yield from section.variables


def _type(variable: Variable, pou: Pou) -> str:
    return f"T_{pou.name}_{variable.name}" if isinstance(variable.type, Array) else variable.type


def _array(array: Array) -> str:
    return f"ARRAY[{', '.join(f'{low}..{high}' for low, high in array.bounds)}] OF {array.element}"


class _Body:
    """A body whose names are made those of its POU; ``@`` marks names that are done."""

    def __init__(self, pou: Pou, pous: dict[str, Pou]) -> None:
        self._pou, self._pous = pou, pous
        self._own = {variable.name: variable for variable in _variables(pou)}

    def text(self) -> str:
        body = re.sub(r"\(\*.*?\*\)", "", self._pou.body, flags=re.S)
        body = MEMBER.sub(self._member, CALL.sub(self._call, body))
        return NAME.sub(self._name, body).replace("@", "")

    def _called(self, instance: str) -> Pou:
        return self._pous[str(self._own[instance].type)]

    def _call(self, found: re.Match[str]) -> str:
        called = self._called(found["instance"])
        given = dict(re.split(r"\s*:=\s*", each.strip()) for each in found["inputs"].split(","))
        every = (
            f"@{variable.name}_{called.name} := {given.get(variable.name) or NOTHING[str(variable.type)]}"
            for section in called.sections
            if section.kind is SectionKind.INPUT
            for variable in section.variables
        )
        return f"{found['instance']}({', '.join(every)});"

    def _member(self, found: re.Match[str]) -> str:
        return f"{found['instance']}.@{found['member']}_{self._called(found['instance']).name}"

    def _name(self, found: re.Match[str]) -> str:
        return f"{found[0]}_{self._pou.name}" if found[0] in self._own else found[0]
