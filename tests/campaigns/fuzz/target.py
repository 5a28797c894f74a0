"""What is fuzzed: one reader of files, or one decoder of frames."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

Read = Callable[[bytes], object]
"""Reads one input; a refusal is one of the errors that the command line tells in words."""


@dataclass(frozen=True, slots=True)
class Target:
    """One reader."""

    seeds: Callable[[Path], list[bytes]]
    opened: Callable[[Path], AbstractContextManager[Read]]
    text: bool = False
    names_file: bool = True


def file_target(
    name: str, read: Callable[[Path], object], seeds: Callable[[Path], list[bytes]], text: bool = False
) -> Target:
    """Return the target of what reads a file of a name."""

    @contextmanager
    def opened(folder: Path) -> Iterator[Read]:
        path = folder / name

        def read_one(data: bytes) -> object:
            path.write_bytes(data)
            return read(path)

        yield read_one

    return Target(seeds, opened, text)
