"""What typer offers for some arguments when a shell asks: names of effects, and of a rig file's experiments."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import typer


def effect_names(incomplete: str) -> Iterator[str]:
    """Yield the effects that begin so; from the text of their files, for importing them takes a second."""
    for file in (files("estimator") / "physics" / "effects").iterdir():
        if file.name.endswith(".py"):
            names = re.findall(r'^    name="(\w+)",$', file.read_text("utf-8"), re.MULTILINE)
            yield from (name for name in names if name.startswith(incomplete))


def experiment_names(ctx: typer.Context, incomplete: str) -> Iterator[str]:
    """Yield the experiments of the rig file on the line that begin so; none of a file that can't be read."""
    try:
        text = Path(ctx.params.get("rig") or "").read_text("utf-8")
    except (OSError, UnicodeDecodeError):
        return
    for name in re.findall(r"^\s*\[experiments\.([^].]*)\]", text, re.MULTILINE):
        if name.startswith(incomplete):
            yield name
