"""``[laws.NAME]`` of a model file and the entry points ``hil.laws``: a user's own laws, by their Python functions.

Using such a law runs the code it names, with the rights of whoever runs the command. A model file may be someone
else's, so it is used only where that was asked for: ``--trust-laws``, or ``trust_laws=True``. Installed packages were
asked for when they were installed.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from estimator.errors import BadModel
from estimator.physics.effect import Element
from estimator.physics.layout import named
from estimator.physics.own_law import LawName, OwnLaw, OwnParameter
from hil.config.table import FileTable, Text
from hil.errors import ModelFileError

GROUP = "hil.laws"
"""Entry points that installed packages offer laws by; each names an ``OwnLaw``."""


class LawParameter(FileTable):
    """A parameter of a law: its unit, where it does nothing, its bounds and where a fit starts."""

    unit: str = ""  # as text, for tables
    null: float = 0.0  # value at which the law does nothing
    low: float  # of a fit
    high: float  # of a fit
    start: float  # of a fit


class LawTable(FileTable):
    """A law: its function as ``module:function``, where it acts, its parameters, and the folder of the module.

    ``folder`` is relative to the file; by default it is the file's own.
    """

    # is imported, and so runs, only where it is trusted
    function: Annotated[str, Field(pattern=r"^[A-Za-z_][\w.]*:[A-Za-z_]\w*$")]
    element: Literal["motor", "shaft", "load", "speed_sensor"]  # of the driveline, that it acts at
    parameters: dict[Text, LawParameter] = Field(min_length=1)  # in the order in which the function takes them
    folder: Text = "."


def laws_of(path: Path, tables: Mapping[str, LawTable], trust_laws: bool) -> tuple[LawName, ...]:
    """Return the laws of a model file and those of installed packages, for the model of that file alone."""
    laws, problems = [], []
    if tables and not trust_laws:
        problems += [_would_run(path, name, table) for name, table in tables.items()]
        tables = {}
    for name, table in tables.items():
        try:
            laws.append(_law(path, name, table))
        except BadModel as error:
            problems += str(error).splitlines()
    try:
        names = named([*laws, *_offered()])
    except BadModel as error:
        problems += str(error).splitlines()
    if problems:
        raise ModelFileError(path, *problems)
    return names


def with_absolute_folders(tables: Mapping[str, LawTable], path: Path) -> dict[str, LawTable]:
    """Return the laws of a model file with folders that hold wherever the model is written to."""
    return {
        name: table.model_copy(update={"folder": str((path.parent / table.folder).resolve())})
        for name, table in tables.items()
    }


def _would_run(path: Path, name: str, table: LawTable) -> str:
    folder = (path.parent / table.folder).resolve()
    return (
        f"laws.{name} | expected --trust-laws, for this law is Python code that runs with your rights | got none: it "
        f"would run {table.function} of {folder}, or of an installed package. Read it before you trust it"
    )


def _law(path: Path, name: str, table: LawTable) -> OwnLaw:
    folder = (path.parent / table.folder).resolve()
    parameters = tuple(OwnParameter(key, p.unit, p.null, p.low, p.high, p.start) for key, p in table.parameters.items())
    return OwnLaw(name, _function(name, table.function, folder), Element(table.element), parameters, table.function)


def _function(name: str, text: str, folder: Path) -> Callable[..., object]:
    module_name, _, function_name = text.partition(":")
    if not os.path.isdir(folder):  # Python would look into an archive too; pathlib raises for a name that can't be
        raise BadModel(f"laws.{name}.folder | expected an existing folder | got {folder}")
    try:
        with _searched_first(folder):
            module = importlib.import_module(module_name)
    except Exception as error:  # a user's module may fail in any way: it is reported as its own
        raise BadModel(
            f"laws.{name}.function | expected module {module_name!r} in {folder} or installed | "
            f"got {type(error).__name__}: {error}"
        ) from error
    function = getattr(module, function_name, None)
    if not callable(function):
        raise BadModel(
            f"laws.{name}.function | expected a function {function_name!r} in {module.__file__} | "
            f"got {'nothing' if function is None else type(function).__name__}"
        )
    return function  # type: ignore[no-any-return]


@contextmanager
def _searched_first(folder: Path) -> Iterator[None]:
    """Look for modules in a folder first, as Python does for a script in it."""
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path.remove(str(folder))


def _offered() -> Iterable[OwnLaw]:
    for point in entry_points(group=GROUP):
        try:
            law = point.load()
        except Exception as error:  # another package's code may fail in any way: it is reported as its own
            raise BadModel(
                f"laws.{point.name} | expected entry point {point.value} to load | got {type(error).__name__}: {error}"
            ) from error
        if not isinstance(law, OwnLaw):
            raise BadModel(f"laws.{point.name} | expected entry point {point.value} to be an OwnLaw | got {law!r}")
        yield law
