"""``python tools/budget.py``: hold each room of the product to its budget of lines, ``[tool.hil.budget]``.

A room that needs more raises its budget in the same commit, with the reason.
"""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent


def lines_of(room: str) -> int:
    """Count the lines of the Python files of a room, or of one file."""
    tracked = subprocess.run(
        ["git", "ls-files", f"{room}/*.py", f"{room}.py"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return sum(
        (ROOT / name).read_text("utf-8").count("\n") for name in tracked.stdout.split() if (ROOT / name).is_file()
    )


def main() -> int:
    """Write a line for each room above its budget; return 1 if there are any."""
    budgets: dict[str, int] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hil"]["budget"]
    over = [
        f"{room}: {used} lines, budget {budget}: make it smaller, or raise the budget in pyproject.toml and say why\n"
        for room, budget in budgets.items()
        if (used := lines_of(room)) > budget
    ]
    sys.stdout.writelines(over)
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
