"""One input tried: read, refused in words, or wrong."""

import random
import re
import resource
import tempfile
import time
import traceback
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from hil.cli.main import exit_status
from tests.campaigns.fuzz.mutate import mutant
from tests.campaigns.fuzz.target import Read, Target

KEPT = Path(__file__).parent / "kept"
"""Inputs that once were wrong, a folder for each target: seeds from then on."""

MOST_SEEDS = 400


@dataclass(frozen=True, slots=True)
class Trial:
    """What became of one input."""

    number: int
    data: bytes
    said: str
    wrong: str
    seconds: float


def trials(name: str, target: Target, seed: int, first: int = 0, grow: bool = True) -> Iterator[Trial]:
    """Try the seeds as they are, then mutants of them without end.

    Where a mutant is refused in words not met before, it has come further than the others: it becomes a seed. Every
    second mutant is one of a whole input.
    """
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        whole = target.seeds(Path(folder))
        seeds = [*whole, *kept(name)]
        read = stack.enter_context(target.opened(Path(folder)))
        _tried(0, whole[0], read, target)  # compiles and loads what is needed: no input takes the time for that
        known = set()
        for number, data in enumerate(seeds):
            trial = _tried(number - len(seeds), data, read, target)
            known.add(_shape(trial.said))
            yield trial
        while True:
            data = mutant(whole if first % 2 else seeds, random.Random(f"{seed}:{name}:{first}"), target.text)
            trial = _tried(first, data, read, target)
            if grow and len(seeds) < MOST_SEEDS and (shape := _shape(trial.said)) not in known:
                known.add(shape)
                seeds.append(data)
            yield trial
            first += 1


def kept(name: str) -> list[bytes]:
    """Return the inputs kept for a target."""
    return [path.read_bytes() for path in sorted((KEPT / name).glob("*"))]


def memory_mib() -> float:
    """Return the most memory this process, or one that it has waited for, has taken so far [MiB]."""
    return max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)) / 1024.0


def _tried(number: int, data: bytes, read: Read, target: Target) -> Trial:
    began_s, said, wrong = time.perf_counter(), "", ""
    try:
        read(data)
    except Exception as error:  # noqa: BLE001 - what is looked for
        said = f"{type(error).__name__}: {error}"
        if exit_status(error) is None:
            wrong = traceback.format_exc()
        elif target.names_file and "input" not in said:
            wrong = f"a refusal that names no file: {said}"
    return Trial(number, data, said, wrong, time.perf_counter() - began_s)


def _shape(said: str) -> str:
    """Leave out of a message what follows from the input."""
    return re.sub(r"'[^']*'|\"[^\"]*\"|[0-9a-fA-F]+", "#", said)[:300]
