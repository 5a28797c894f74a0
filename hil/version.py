"""The version of this program, the commit that it was made from, as results carry them, and its optional libraries."""

import os
import re
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path
from typing import Final

__version__ = "0.3.0"

DISTRIBUTION: Final = "hil-driveline"
"""Name of this project where it is installed."""

PACKAGE: Final = Path(__file__).resolve().parent
COMMIT_FILE: Final = "commit.txt"
"""In a wheel and an sdist: the commit that they were built from (tools/build_hook.py writes it)."""
UNKNOWN: Final = "commit unknown"


@cache
def program() -> str:
    """Return name, version and commit: ``hil 0.3.0 (1a2b3c4d5e6f)``; ``commit unknown`` in place of one."""
    return f"hil {__version__} ({_commit() or UNKNOWN})"


def _commit() -> str:
    """Return the first 12 digits of the commit; with `, changed` where files of the program differ from it."""
    kept = PACKAGE / COMMIT_FILE
    if kept.is_file():
        return kept.read_text("ascii").strip()
    return commit_of(PACKAGE.parent)


def install_hint(extra: str) -> str:
    """Return the command that installs the libraries of an extra of pyproject.toml, such as ``fmu``.

    They are named themselves, with the versions of the installed copy: no package index has this project.
    """
    try:
        lines = requires(DISTRIBUTION) or []
    except PackageNotFoundError:
        lines = []
    of_extra = (line.partition(";") for line in lines)
    needed = [f"'{library.strip()}'" for library, _, of in of_extra if re.fullmatch(rf" *extra == .{extra}.", of)]
    return f"pip install {' '.join(needed)}" if needed else f"pip install '.[{extra}]' in the folder of this project"


def commit_of(checkout: Path) -> str:
    """Return the commit of a checkout of this project as above; nothing where it is none, or Git is missing."""
    if not (checkout / ".git").exists():  # else Git would find the repository that a site-packages happens to be in
        return ""
    try:
        commit = _git(checkout, "rev-parse", "--short=12", "HEAD")
        changed = _git(checkout, "status", "--porcelain", "--untracked-files=no", "--", "hil", "drivers", "estimator")
    except (OSError, subprocess.SubprocessError):
        return ""
    return commit + ", changed" * bool(changed)


def _git(checkout: Path, *words: str) -> str:
    """Ask Git about a checkout and about no other: its hooks name one by GIT_DIR."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    line = ("git", "--no-optional-locks", "-C", str(checkout), *words)
    done = subprocess.run(line, env=environment, capture_output=True, text=True, check=True, timeout=10)
    return done.stdout.strip()
