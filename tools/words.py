"""``python tools/words.py``: find words that only this project would use.

``tools/words.toml`` has each with a better one.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent
SUFFIXES = {".c", ".cff", ".css", ".js", ".md", ".py", ".st", ".toml"}
LEFT_OUT = {"tools/words.toml"}


def texts() -> Iterator[tuple[str, str]]:
    """Yield path and text of each file that is kept under version control and written by hand."""
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    for path in tracked.stdout.splitlines():
        if Path(path).suffix in SUFFIXES and path not in LEFT_OUT and (ROOT / path).is_file():
            yield path, (ROOT / path).read_text("utf-8")


def found(better: dict[str, str], text: str) -> Iterator[tuple[int, str, str]]:
    """Yield line, word, and what to say instead; each part of a name (as of ``is_late``) is a word."""
    for word, say in better.items():
        for hit in re.finditer(rf"(?<![A-Za-z])(?:{word})(?![a-z])", text, re.IGNORECASE):
            yield text.count("\n", 0, hit.start()) + 1, hit[0], say


def main() -> int:
    """Write a line for each word; return 1 if there are any."""
    better: dict[str, str] = tomllib.loads((HERE / "words.toml").read_text("utf-8"))["words"]
    lines = [f"{path}:{line}: {word}: {say}\n" for path, text in texts() for line, word, say in found(better, text)]
    sys.stdout.writelines(lines)
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
