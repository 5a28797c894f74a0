"""A PLCopen project, as `plcopen_reading` reads it, in the part of Structured Text that pyplcopen compiles.

What it has not got, and the standard has: unnamed array types, constants in function blocks, calls that leave out an
input, and a name that is declared in two POUs (it puts the bodies of the blocks that are called into one program).
Statements and expressions stay as they are, but for the names.
"""

import re
from collections.abc import Iterator
from typing import Any

from tests.export.plcopen_reading import KEYWORD, initial_of, sections_of, text_of, type_of

CALL = re.compile(r"\b(?P<instance>\w+)\((?P<inputs>\w+ := [^;]*)\);")
MEMBER = re.compile(r"\b(?P<instance>[A-Za-z]\w*)\.(?P<member>\w+)")
NAME = re.compile(r"(?<![\w@])[A-Za-z]\w*")

NOTHING = {"BOOL": "FALSE", "INT": "0", "DINT": "0", "LREAL": "0.0", "REAL": "0.0"}


def in_dialect(project: Any) -> str:
    """Return the whole text."""
    named = (f"TYPE\n{kind.name} : {type_of(kind.base_type)};\nEND_TYPE" for kind in project.types.data_types.data_type)
    pous = {pou.name: pou for pou in project.types.pous.pou}
    return "\n".join((*named, *(each for pou in pous.values() for each in _pou(pou, pous)), ""))


def _pou(pou: Any, pous: dict[str, Any]) -> Iterator[str]:
    keyword = KEYWORD[pou.pou_type.value]
    for variable in _variables(pou):
        if variable.type.array is not None:
            yield f"TYPE\n{_type(variable, pou)} : {type_of(variable.type)};\nEND_TYPE"
    yield f"{keyword} {pou.name}"
    for kind, section in sections_of(pou.interface):
        lines = (f"{each.name}_{pou.name} : {_type(each, pou)}{initial_of(each)};" for each in section.variable)
        yield "\n".join((kind, *lines, "END_VAR"))
    yield f"{_Body(pou, pous).text()}\nEND_{keyword}"


def _variables(pou: Any) -> Iterator[Any]:
    for _, section in sections_of(pou.interface):
        yield from section.variable


def _type(variable: Any, pou: Any) -> str:
    return type_of(variable.type) if variable.type.array is None else f"T_{pou.name}_{variable.name}"


class _Body:
    """A body whose names are made those of its POU; ``@`` marks names that are done."""

    def __init__(self, pou: Any, pous: dict[str, Any]) -> None:
        self._pou, self._pous = pou, pous
        self._own = {variable.name: variable for variable in _variables(pou)}

    def text(self) -> str:
        body = re.sub(r"\(\*.*?\*\)", "", text_of(self._pou.body[0].st), flags=re.S)
        body = MEMBER.sub(self._member, CALL.sub(self._call, body))
        return NAME.sub(self._name, body).replace("@", "")

    def _called(self, instance: str) -> Any:
        return self._pous[type_of(self._own[instance].type)]

    def _call(self, found: re.Match[str]) -> str:
        called = self._called(found["instance"])
        given = dict(re.split(r"\s*:=\s*", each.strip()) for each in found["inputs"].split(","))
        every = (
            f"@{variable.name}_{called.name} := {given.get(variable.name) or NOTHING[type_of(variable.type)]}"
            for section in called.interface.input_vars
            for variable in section.variable
        )
        return f"{found['instance']}({', '.join(every)});"

    def _member(self, found: re.Match[str]) -> str:
        return f"{found['instance']}.@{found['member']}_{self._called(found['instance']).name}"

    def _name(self, found: re.Match[str]) -> str:
        return f"{found[0]}_{self._pou.name}" if found[0] in self._own else found[0]
