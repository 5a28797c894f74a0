"""A small disk of its own: a file system in a file, mounted, that can be filled, and frozen as one that stalls is."""

import os
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

SIZE_BYTES = 24 << 20

CHUNK_BYTES = 1 << 16


class Disk:
    """A mounted file system."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._thaw: threading.Timer | None = None

    def fill(self) -> None:
        """Leave no room: the next write meets ENOSPC."""
        with (self.root / "filler").open("wb", buffering=0) as filler:
            for size in (CHUNK_BYTES, 1, CHUNK_BYTES, 1):  # once written out it often takes less room than set aside
                with suppress(OSError):
                    while filler.write(bytes(size)) == size:
                        pass
                os.fsync(filler)

    def stall(self, duration_s: float) -> None:
        """Have every write wait for so long; returns at once."""
        _call("fsfreeze", "-f", self.root)
        self._thaw = threading.Timer(duration_s, lambda: _call("fsfreeze", "-u", self.root))
        self._thaw.start()

    def await_end_of_stall(self) -> None:
        """Wait until writes succeed again."""
        if self._thaw is not None:
            self._thaw.join()


@contextmanager
def disk(folder: Path) -> Iterator[Disk]:
    """Make a disk in a folder, and mount it."""
    image, root = folder / "disk.img", folder / "disk"
    with image.open("wb") as file:
        file.truncate(SIZE_BYTES)
    root.mkdir()
    _call("mkfs.ext4", "-q", "-m", "0", "-b", "1024", image)  # small blocks: soon full
    _call("mount", "-o", "loop", image, root)
    mounted = Disk(root)
    try:
        yield mounted
    finally:
        mounted.await_end_of_stall()
        _call("umount", root)


@cache
def can_mount() -> bool:
    """Whether this machine lets this user make such a disk."""
    try:
        with TemporaryDirectory() as folder, disk(Path(folder)):
            return True
    except (subprocess.CalledProcessError, FileNotFoundError):
        return False


def _call(*command: str | Path) -> None:
    subprocess.run(command, check=True, capture_output=True)
