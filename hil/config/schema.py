"""JSON schemas of the files people write, for editors that complete and check while one types.

An editor finds the schema by the first line of the file, ``#:schema ./rig.schema.json`` (as the TOML language servers
read it). A schema knows keys, types and bounds; rules across keys are checked when the file is read.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from hil.config.model_tables import ModelDocument
from hil.config.rig_file import Rig
from hil.config.table import FileKind

DIALECT: Final = GenerateJsonSchema.schema_dialect


class _Schema(GenerateJsonSchema):
    """Pydantic's schema, in the words of a TOML file: a key that may be left out is left out, and never null."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        written = super().default_schema(schema)
        return {key: value for key, value in written.items() if key != "default" or value is not None}


def json_schema(kind: FileKind) -> dict[str, Any]:
    """Return the schema of a kind of file."""
    document = _model(kind).model_json_schema(schema_generator=_Schema)
    return {"$schema": DIALECT, "title": f"{kind.name.lower()} file of hil", **_without_titles(document)}


def schema_text(kind: FileKind) -> str:
    """Return the same as a text, one key per line."""
    return json.dumps(json_schema(kind), indent=2, ensure_ascii=False) + "\n"


def _model(kind: FileKind) -> type[BaseModel]:
    return Rig if kind is FileKind.RIG else ModelDocument


def _without_titles(value: Any) -> Any:
    """Leave out the titles that only repeat a key."""
    if isinstance(value, Mapping):
        keep = {key: _without_titles(part) for key, part in value.items()}
        return {key: part for key, part in keep.items() if key != "title" or not isinstance(part, str)}
    return [_without_titles(part) for part in value] if isinstance(value, list) else value
