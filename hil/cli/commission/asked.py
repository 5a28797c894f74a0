"""What is asked of single steps, and who answers what the script asks."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from hil.commission.engine import NAMES, Asked
from hil.commission.talk import Person, Script, Talk
from hil.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console


def asked_of_steps(skip: Sequence[str], because: Sequence[str], repeat: Sequence[str]) -> Asked:
    """Put together what is asked of single steps."""
    for name in (*skip, *repeat):
        if name not in NAMES:
            raise UsageError(f"step {name!r}: expected one of {', '.join(NAMES)}. Name one of these.")
    if both := sorted(set(skip) & set(repeat)):
        raise UsageError(f"step {both[0]!r}: expected --skip or --repeat, got both. Leave one out.")
    if len(because) not in ({0} if not skip else {1, len(skip)}) or not all(text.strip() for text in because):
        raise UsageError(
            f"expected a reason for each of {len(skip)} skipped steps (--because TEXT, one for each or one for all), "
            f"got {len(because)}. A skipped step is recorded with its reason."
        )
    reasons = list(because) * (len(skip) if len(because) == 1 else 1)
    return Asked(dict(zip(skip, reasons, strict=True)), frozenset(repeat))


def who_answers(console: Console, yes: bool, keep: str) -> Talk:
    """Choose who is asked: someone at the terminal, where standard input and output are one."""
    if sys.stdin.isatty() and console.is_terminal:
        return Person(lambda question: console.input(question, markup=False), yes, keep)
    return Script(yes, keep)
