"""Values and tables of ``hil runs``: they fit a terminal and are plain text in a pipe."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def cell(value: Any) -> str:
    """Write a value as it stands in a line or a cell; nothing where there is none."""
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def print_columns(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(*heads, box=None, pad_edge=False)
    for row in rows:
        table.add_row(*(Text(text) for text in row))  # as it is: "[Hz]" is no markup
    console = Console()
    console.print(table, soft_wrap=not console.is_terminal)
