"""The public command line, run as any user would: in a process of its own, in a folder of its own."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

from hil.child import environment, python


class CommandFailed(Exception):
    """A command of the tool ended with another status than 0, or not in time."""


def run_hil(arguments: Sequence[str], folder: Path, limit_s: float) -> None:
    """Run ``hil`` in a folder.

    Parameters
    ----------
    limit_s
        Time it may take [s]; then it is ended and counts as failed.

    Raises
    ------
    CommandFailed
        With the last line it wrote, or that it took too long. All it wrote is next to the folder.
    """
    try:
        done = subprocess.run(
            python("-m", "hil", *arguments),
            cwd=folder,
            env=environment(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            timeout=limit_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise CommandFailed(f"hil {arguments[0]}: took longer than {limit_s:g} s and was ended") from None
    if done.returncode != 0:
        (folder.parent / f"{arguments[0]}.stderr.txt").write_text(done.stderr, encoding="utf-8")
        said = done.stderr.strip().splitlines() or ["nothing on standard error"]
        raise CommandFailed(f"hil {arguments[0]}: ended with status {done.returncode}: {said[-1].strip()}")
