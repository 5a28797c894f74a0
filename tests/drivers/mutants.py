"""Mutants of an EDS: one key dropped, blanked, doubled, or with a value of another type."""

import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from drivers.eds_check import check_eds

KINDS = ("dropped", "blanked", "doubled", "another type")
OTHER_VALUES = ("fast", "-1", "0xFFFFFFFFF", "3.5", "0x9", "ro", "$NODEID", "1")
_KEY = re.compile(r"\s*([^;\[#=\s][^=]*?)\s*=(.*)")


@dataclass(frozen=True)
class Mutant:
    """One changed file: its text, and what was changed where."""

    text: str
    kind: str
    line: int
    was: str

    def __str__(self) -> str:
        return f"line {self.line} {self.kind}: {self.was}"


def mutants(eds: Path, count: int, seed: int) -> Iterator[Mutant]:
    """Make mutants of a file; of two one is of an object in use, for elsewhere little happens."""
    lines = eds.read_text(encoding="latin-1").splitlines()
    used = sorted(_used_lines(eds, lines))
    every = [n for n, line in enumerate(lines) if _KEY.match(line)]
    chance = random.Random(f"{eds.name} {seed}")
    for k in range(count):
        n = chance.choice(used if used and k % 2 else every)
        kind = chance.choice(KINDS)
        changed = list(lines)
        changed[n : n + 1] = _changed(lines[n], kind, chance)
        yield Mutant("\n".join(changed), kind, n + 1, lines[n].strip())


def _changed(line: str, kind: str, chance: random.Random) -> list[str]:
    key = line.partition("=")[0]
    if kind == "dropped":
        return []
    if kind == "blanked":
        return [f"{key}="]
    if kind == "doubled":
        return [line, chance.choice((line, f"{key}=7"))]
    return [f"{key}={chance.choice(OTHER_VALUES)}"]


def _used_lines(eds: Path, lines: list[str]) -> Iterator[int]:
    """Find the lines of objects in use."""
    plan = check_eds(eds).plan
    used = frozenset() if plan is None else plan.used
    here = False
    for n, line in enumerate(lines):
        header = re.match(r"\s*\[([0-9A-Fa-f]{4})(sub[0-9A-Fa-f]+)?\]", line)
        here = int(header[1], 16) in used if header else here and not line.lstrip().startswith("[")
        if here and _KEY.match(line):
            yield n
