"""A model in Python: read from a file, with how its recordings are read."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hil.config.model_file import ModelFile, read_model_for_recordings
from hil.errors import UsageError
from hil.problems import problem_lines
from hil.recording.signals_config import SignalsConfig

Model = Path | str | ModelFile
"""A model file, by its path or as it was read."""


def read_model(path: Path | str, trust_laws: bool = False) -> ModelFile:
    """Read a model file; laws of its own run only where they are trusted.

    Raises
    ------
    ModelFileError
        With one line for every fault.
    """
    return read_model_for_recordings(path, trust_laws)


def as_file(model: Model) -> ModelFile:
    """Return a model file, read where a path is given."""
    return model if isinstance(model, ModelFile) else read_model(model)


Signals = Mapping[str, Any] | str
"""A ``[signals]`` table: as a mapping, or its lines as `hil.look` gives them."""


def signals_of(signals: Signals | None, model: Model | None) -> tuple[SignalsConfig, bool]:
    """Return how a recording is read, and whether it is of a joint on a bench."""
    file = None if model is None else as_file(model)
    on_bench = file is not None and file.on_bench
    if signals is None:
        return (file.signals if file is not None else None) or SignalsConfig(), on_bench
    try:
        return SignalsConfig.model_validate(signals_as_table(signals)), on_bench
    except ValidationError as error:
        raise UsageError("signals: " + "; ".join(problem_lines(SignalsConfig, error))) from error


def signals_as_table(signals: Signals) -> dict[str, Any]:
    """Return the keys of a ``[signals]`` table."""
    try:
        if isinstance(signals, str):
            content = tomllib.loads(signals)
            return dict(content.get("signals", content))
        return dict(signals)
    except (TypeError, ValueError) as error:
        raise UsageError(
            "signals: expected a mapping, or the lines of a [signals] table such as hil.look(FILE).signals, got "
            f"{type(signals).__name__}: {error}"
        ) from error
