"""Follow the place of a validation error through the annotations of a pydantic model.

pydantic's place holds more than the file's keys: in a union it also names the member it tried. A reader of
the file must see only the keys, and, where a key is unknown, the keys that are known there.
"""

from __future__ import annotations

import types
import typing
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

Key = int | str


@dataclass(frozen=True, slots=True)
class ModelWalk:
    """Where a walk has come to: the file's keys so far, and the annotation found there (None: not known)."""

    keys: tuple[Key, ...]
    annotation: Any

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
