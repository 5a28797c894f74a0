"""What configuration files share: tables that are frozen, strict and complete; field types; the line of the schema."""

from __future__ import annotations

import os
from enum import Enum
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo


class FileTable(BaseModel):
    """A table of a file: a number is no text, an unknown key is a fault, nothing changes after reading."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


def _next_to_the_file(value: object, info: ValidationInfo) -> Path:
    """Resolve a path against the folder of the file it stands in, and see that it is there.

    It may lie anywhere: who starts drives by a rig file is its author, and nothing is written to what it names.
    """
    if not isinstance(value, str):
        raise ValueError("the path of a file, as text")
    folder: Path = (info.context or {}).get("path", Path("file")).parent
    path = (folder / value).resolve()
    if not os.path.isfile(path):  # False also for a name that no system can have, where pathlib raises
        raise ValueError(f"an existing file, looked for {path}")
    return path


Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Text = Annotated[str, Field(min_length=1)]
TcpPort = Annotated[int, Field(ge=1, le=65535)]
Unsigned32 = Annotated[int, Field(ge=0, le=0xFFFF_FFFF)]
ExistingFile = Annotated[Path, BeforeValidator(_next_to_the_file)]
"""A file, relative to the folder of the file that names it; read as an absolute path."""


class FileKind(Enum):
    """A kind of file; the value is its schema's file name."""

    RIG = "rig.schema.json"
    MODEL = "model.schema.json"


def schema_line(kind: FileKind) -> str:
    """Return the first line of such a file: the TOML language servers look for the schema there."""
    return f"#:schema ./{kind.value}"
