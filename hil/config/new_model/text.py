"""The text of a new model file: every line with what it is."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

from estimator.physics.model import DrivelineModel, Motion, parameter_unit
from hil.config.file_schema import FileKind, schema_line
from hil.config.model_tables import SCHEMA, ModelDocument
from hil.config.new_model.values import MEANINGS, Known
from hil.errors import ModelFileError
from hil.printable import printable
from hil.problems import validate

COMMENTS_AT = 48
"""Column in which comments begin."""


def model_text(
    file: Path, model: DrivelineModel, known: Mapping[str, Known], signals: Sequence[str], recording: Path | None
) -> str:
    """Return the file, checked as any model file is."""
    where = "at the motor shaft" if model.motion is Motion.ROTATION else "in the line of travel"
    source = "REC" if recording is None else printable(recording.name)
    lines = [
        schema_line(FileKind.MODEL),
        f"# A model of a driveline. All values are SI, {where}.",
        f"#   hil diagnose {source} --model {printable(file.name)} --out report",
        "",
        f'schema = "{SCHEMA}"',
        _line(f'structure = "{model.structure.value}"', "one_mass, two_mass, three_mass or joint"),
        _line(f'motion = "{model.motion.value}"', "rotation, or translation: kg, N, m"),
        "",
        "# Each value with the relative tolerance that it is trusted to: what re-tuning within it explains is no",
        "# missing physics. 0: known exactly.",
        "[parameters]",
    ]
    for name, parameter in model.parameters.items():
        by = known[name].source if name in known and known[name].value == parameter.value else ""
        comment = f"{MEANINGS[name]}, {parameter_unit(name, model.motion)}{f'; {printable(by)}' if by else ''}"
        entry = f"{name} = {{ value = {parameter.value!r}, tolerance = {parameter.tolerance!r} }}"
        lines.append(_line(entry, comment))
    if signals:
        lines += ["", f"# What is what in a recording, as hil look found it in {source}: check it.", *signals]
    text = "\n".join([*lines, ""])
    validate(ModelDocument, tomllib.loads(text), file, ModelFileError)
    return text


def _line(code: str, comment: str) -> str:
    return f"{code:<{COMMENTS_AT - 1}} # {comment}"
