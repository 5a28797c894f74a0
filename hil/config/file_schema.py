"""The kinds of files people write, and the line by which an editor finds the JSON schema of each."""

from __future__ import annotations

from enum import Enum


class FileKind(Enum):
    """A kind of file; the value is its schema's file name."""

    RIG = "rig.schema.json"
    MODEL = "model.schema.json"


def schema_line(kind: FileKind) -> str:
    """Return the first line of such a file: the TOML language servers look for the schema there."""
    return f"#:schema ./{kind.value}"
