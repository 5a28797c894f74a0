"""The bar of a computation between runs and questions."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Self

from hil.cli.diagnose import progress_bar


class Bar:
    """A bar of a computation, on standard error where that is a terminal; there from its first word to its last.

    In between the terminal belongs to runs and questions.
    """

    def __init__(self) -> None:
        self._open = ExitStack()
        self._show: Callable[[str, float], None] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._open.close()

    def show(self, stage: str, share: float) -> None:
        """Show what is being done and the share of the work behind it; 1 ends the bar."""
        if self._show is None:
            self._show = self._open.enter_context(progress_bar())
        self._show(stage, share)
        if share >= 1.0:
            self._open.close()
            self._show = None
