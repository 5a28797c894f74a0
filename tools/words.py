"""``python tools/words.py``: find words that only this project would use.

``tools/words.toml`` has each with a better one. A folder that is listed there under ``to_do`` may keep as many as the
list says; everything else has none.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from collections import defaultdict
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
    """Write a line for each word where there are too many; return 1 if there are any."""
    lists = tomllib.loads((HERE / "words.toml").read_text("utf-8"))
    to_do: dict[str, int] = lists["to_do"]
    lines: dict[str, list[str]] = defaultdict(list)
    for path, text in texts():
        folder = max((folder for folder in to_do if path.startswith(folder)), key=len, default="")
        lines[folder] += [f"{path}:{line}: {word}: {say}" for line, word, say in found(lists["words"], text)]
    too_many = {folder: said for folder, said in lines.items() if len(said) > to_do.get(folder, 0)}
    for folder, said in too_many.items():
        sys.stdout.write("\n".join(said) + f"\n{folder or 'elsewhere'}: {len(said)}, allowed {to_do.get(folder, 0)}\n")
    return 1 if too_many else 0


if __name__ == "__main__":
    sys.exit(main())
