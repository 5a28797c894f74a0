"""Help texts that flow: a paragraph of a docstring is one paragraph on the terminal, whatever its width.

Typer joins the lines of the first paragraph only and prints the others as they are broken in the source, which on
80 columns leaves single words on lines of their own.
"""

from __future__ import annotations

import inspect
import re
from typing import Any

import typer


def flow(app: typer.Typer) -> None:
    """Let the help of every command of an application, and of its groups, flow."""
    infos: list[Any] = [*app.registered_commands, app.registered_callback]
    for info in infos:
        if info is not None and info.callback is not None:
            text = info.help if isinstance(info.help, str) else info.callback.__doc__
            info.help = flowing(text or "")
    for group in app.registered_groups:
        if group.typer_instance:
            flow(group.typer_instance)


def flowing(text: str) -> str:
    """Join the lines of each paragraph; a paragraph with an indented line, such as a list, stays as it is."""
    paragraphs = re.split(r"\n\s*\n", inspect.cleandoc(text))
    return "\n\n".join(part if "\n " in part else part.replace("\n", " ") for part in paragraphs)
