"""All faults of a hand-written TOML file at once, one line each: ``key | expected ... | got ...``.

Two steps serve every file of this program, each with the error class of the file at hand:

1. `read_toml` turns text into a dictionary, or names the line that is not TOML;
2. `validate` turns the dictionary into a pydantic model, or names every key at fault.

Rules across keys are model validators that call `refuse` with every fault they find.

The place of a validation error holds more than the file's keys: in a union pydantic also names the member it tried. A
reader of the file must see only the keys, and, where a key is unknown, the keys that are known there: `ModelWalk`
follows the place through the annotations of the model.
"""

from __future__ import annotations

import re
import tomllib
import types
import typing
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticCustomError

from drivers.foreign_file import read_regular
from hil.errors import FileProblem

Model = TypeVar("Model", bound=BaseModel)

ACROSS_KEYS: Final = "across_keys"
"""Type of the validation errors made by `refuse`."""

TOML_PLACE: Final = re.compile(r"^(?P<what>.*) \(at (?P<place>line \d+, column \d+|end of document)\)$", re.DOTALL)
"""How `tomllib` ends its messages; it has no attributes for the place before Python 3.14."""

BYTE_ORDER_MARK: Final = "\ufeff"
"""Some editors put it first; TOML 1.0 has no place for it, and a person can't see it."""

LARGEST_BYTES: Final = 16 << 20
"""A file that a person wrote has some kilobytes; a wrong one shall not fill the memory."""

LONGEST_VALUE: Final = 80
"""Characters of a wrong value that a message shows."""


WORDS: Final[Mapping[str, str]] = {
    "dict_type": "a table",
    "model_type": "a table",
    "list_type": "a list in [ ]",
    "string_too_short": "a text that is not empty",
}
"""Errors of pydantic, by type, that a person who writes TOML would not understand."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One broken rule across keys: the key to fix (dotted, from the validator's own table), and why."""

    key: str  # empty for the table itself
    expected: str  # continues "expected"
    got: object  # the value; a table is shown as "a table"


def refuse(faults: Iterable[Fault]) -> None:
    """Refuse a table with all its faults; for the model validators that check rules across keys."""
    found = tuple(faults)
    if found:
        raise PydanticCustomError(ACROSS_KEYS, "rules across keys are broken", {"faults": found})


def read_toml(path: Path, error: type[FileProblem]) -> dict[str, Any]:
    """Read one TOML file."""
    try:
        content = read_regular(path, LARGEST_BYTES)
    except OSError as cause:
        raise error(path, f"the file | expected a readable TOML file | got: {cause.strerror}") from cause
    try:
        tables = tomllib.loads(content.decode("utf-8").removeprefix(BYTE_ORDER_MARK))
        problems = list(_beyond_64_bit(tables))
    except UnicodeDecodeError as cause:
        line = content.count(b"\n", 0, cause.start) + 1
        byte = content[cause.start]
        raise error(path, f"line {line} | expected UTF-8 text | got byte 0x{byte:02x}: save as UTF-8") from cause
    except tomllib.TOMLDecodeError as cause:
        raise error(path, _toml_problem(str(cause))) from cause
    except RecursionError:
        raise error(path, "the file | expected tables | got some nested too deep") from None
    except ValueError as cause:  # a whole number of thousands of digits
        raise error(path, f"the file | expected whole numbers of 64 bit | got: {cause}") from cause
    if problems:
        raise error(path, *problems)
    return tables


def _beyond_64_bit(value: object, *keys: int | str) -> Iterator[str]:
    """Name whole numbers that TOML does not have (TOML 1.0, Integer)."""
    if isinstance(value, int) and not -(1 << 63) <= value < 1 << 63:
        yield _line(keys, "a whole number of 64 bit", f"one of {value.bit_length()} bit")
    elif isinstance(value, dict):
        for key, entry in value.items():
            yield from _beyond_64_bit(entry, *keys, key)
    elif isinstance(value, list):
        for number, entry in enumerate(value):
            yield from _beyond_64_bit(entry, *keys, number)


def validate(model: type[Model], data: Mapping[str, Any], path: Path, error: type[FileProblem]) -> Model:
    """Check a file's tables against a model."""
    try:
        return model.model_validate(data, context={"path": path})
    except ValidationError as cause:
        raise error(path, *problem_lines(model, cause)) from cause


def problem_lines(model: type[BaseModel], cause: ValidationError) -> list[str]:
    """Put a validation error into lines ``key | expected ... | got ...``, one per fault."""
    return [line for detail in cause.errors() for line in _lines(model, detail)]


def _toml_problem(message: str) -> str:
    match = TOML_PLACE.match(message)
    what, place = (match["what"], match["place"]) if match else (message, "the file")
    return f"{place} | expected TOML | got: {what}"


def _lines(model: type[BaseModel], detail: ErrorDetails) -> Iterator[str]:
    """Word one of pydantic's errors; those of `refuse` carry several faults."""
    where, kind, context = detail["loc"], detail["type"], detail.get("ctx", {})
    table = ModelWalk.along(model, where)
    if kind == ACROSS_KEYS:
        for fault in context["faults"]:
            yield _line((*table.keys, fault.key), fault.expected, _shown(fault.got))
    elif kind == "missing":
        yield _line(table.keys, "this key", "nothing: add it")
    elif kind == "extra_forbidden":
        known = ", ".join(ModelWalk.along(model, where[:-1]).known_keys())
        yield _line(table.keys, f"one of the known keys ({known})", "this unknown key: fix or remove it")
    elif kind in ("union_tag_invalid", "union_tag_not_found"):
        got = repr(context["tag"]) if "tag" in context else "nothing: add it"
        yield _line((*table.keys, context["discriminator"].strip("'")), f"one of {table.known_tags()}", got)
    elif kind == "list_type" and isinstance(detail["input"], Mapping) and table.is_of_tables:
        name = ".".join(map(str, table.keys))
        yield _line(table.keys, f"a list of tables, [[{name}]] or [ {{ ... }} ]", f"one table, [{name}] or {{ ... }}")
    else:
        yield _line(table.keys, _expected(detail), _shown(detail["input"]))


def _line(keys: Iterable[int | str], expected: str, got: str) -> str:
    key = ".".join(str(part) for part in keys if part != "") or "the file"
    return f"{key} | expected {expected} | got {got}"


def _expected(detail: ErrorDetails) -> str:
    """Keep pydantic's own words but for `WORDS`, without the part that every one of its messages begins with."""
    message = WORDS.get(detail["type"], detail["msg"])
    for opening in ("Input should be ", "Value error, "):
        message = message.removeprefix(opening)
    return message[:1].lower() + message[1:]


def _shown(value: object) -> str:
    text = "a table" if isinstance(value, Mapping) else repr(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 3]}..."


Key = int | str


@dataclass(frozen=True, slots=True)
class ModelWalk:
    """Where a walk has come to: the file's keys so far, and the annotation found there (None: not known)."""

    keys: tuple[Key, ...]  # numbers are places in a list, from 0
    annotation: Any  # of a field of a pydantic model

    @classmethod
    def along(cls, model: type[BaseModel], where: Sequence[Key]) -> ModelWalk:
        """Walk from the model of the whole file along ``where``, the ``loc`` of a validation error."""
        walk = cls((), model)
        for part in where:
            walk = walk._step(part)
        return walk

    def known_keys(self) -> list[str]:
        """List the keys of the table the walk has come to; empty where it is not a table of named keys."""
        members = _members(self.annotation) or (self.annotation,)
        return [key for member in members for key in _fields(member)]

    def known_tags(self) -> str:
        """List the tags of the union the walk has come to, quoted."""
        tags = [tag for member in _members(self.annotation) for tag in _tags(member)]
        return ", ".join(repr(tag) for tag in tags)

    @property
    def is_of_tables(self) -> bool:
        """Whether the walk has come to a list of tables."""
        is_list = typing.get_origin(self.annotation) in (list, tuple)
        return is_list and any(_fields(each) for each in typing.get_args(self.annotation))

    def _step(self, part: Key) -> ModelWalk:
        for member in _members(self.annotation):
            if part in _tags(member) or part == getattr(member, "__name__", None):
                return ModelWalk(self.keys, member)  # a member of a union: no key of the file
        return ModelWalk((*self.keys, part), self._below(part))

    def _below(self, part: Key) -> Any:
        for member in _members(self.annotation) or (self.annotation,):
            fields = _fields(member)
            if part in fields:
                return fields[str(part)].annotation
            if typing.get_origin(member) in (dict, list):
                return typing.get_args(member)[-1]
        return None


def _members(annotation: Any) -> tuple[Any, ...]:
    """Members of a union, seen through `Annotated`; empty for anything else."""
    if typing.get_origin(annotation) is typing.Annotated:
        return _members(typing.get_args(annotation)[0])
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return typing.get_args(annotation)
    return ()


def _tags(member: Any) -> tuple[Any, ...]:
    """Values of the literal fields of a union's member: what a discriminator may hold."""
    literals = (field.annotation for field in _fields(member).values())
    return tuple(tag for each in literals if typing.get_origin(each) is typing.Literal for tag in typing.get_args(each))


def _fields(annotation: Any) -> dict[str, FieldInfo]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return {field.alias or name: field for name, field in annotation.model_fields.items()}
    return {}
