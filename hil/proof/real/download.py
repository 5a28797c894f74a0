"""``python -m hil.proof.real.download --to DIR [NAME...]``: the recordings, from where they are published.

Every file is checked against its SHA-256 before it takes its place; one that is there and right is not fetched again.
A transfer that broke off continues from where it stopped. Where a file can't be had, the message says what to download
by hand and where to put it.
"""

from __future__ import annotations

import argparse
import io
import sys
import zipfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from hil.errors import HilError, UsageError
from hil.proof.real.case_file import ROOM, Conversion, Origin, RecordingEntry, case_folders, read_case
from hil.proof.real.convert import CONVERSIONS, NotAsPublished
from hil.proof.real.fetch import FetchFailed, fetch
from hil.proof.real.prepare import sha256_of

_FAILED = 2
_INTERRUPTED = 130

Tell = Callable[[str], None]


class NotToBeHad(Exception):
    """A recording could not be downloaded; the message says what to do by hand."""


def wanted(names: Sequence[str], room: Path = ROOM) -> dict[str, RecordingEntry]:
    """Return the recordings of cases, each file once, by its place in the data folder.

    Raises
    ------
    UsageError
        If there is no such case, or two disagree about a file.
    RealFileError
        If a case's file is wrong.
    """
    found: dict[str, RecordingEntry] = {}
    for folder in case_folders(list(names), room).values():
        for entry in read_case(folder).recordings.values():
            other = found.setdefault(entry.path, entry)
            if (other.sha256, other.origin) != (entry.sha256, entry.origin):
                raise UsageError(f"{entry.path}: expected one checksum and origin in all cases, got two ({folder})")
    return found


def download(entries: Iterable[RecordingEntry], to: Path, tell: Tell) -> list[str]:
    """Download what is missing; return what could not be had, a message each.

    Parameters
    ----------
    to
        The data folder.
    tell
        Called with what was done, a line for each recording.
    """
    failed = []
    for entry in entries:
        try:
            tell(f"{entry.path}: {_one(entry, to)}")
        except NotToBeHad as error:
            failed.append(str(error))
    return failed


def _one(entry: RecordingEntry, to: Path) -> str:
    """Have one recording; return how."""
    path = to / entry.path
    if path.exists() and sha256_of(path) == entry.sha256:
        return "there already"
    if entry.origin.url is None:
        raise NotToBeHad(_by_hand(entry, path, "its page asks for an account"))
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part")
    try:
        fetch(entry.origin.url, part)
        content = CONVERSIONS[entry.origin.convert](_unpacked(part, entry.origin))
    except FetchFailed as error:
        raise NotToBeHad(_by_hand(entry, path, str(error))) from error
    except NotAsPublished as error:
        part.unlink()
        raise NotToBeHad(_by_hand(entry, path, str(error))) from error
    part.write_bytes(content)
    got = sha256_of(part)
    if got != entry.sha256:
        part.unlink()
        raise NotToBeHad(_by_hand(entry, path, f"expected the SHA-256 {entry.sha256}, got {got}"))
    part.replace(path)
    return f"from {entry.origin.url}"


def _unpacked(part: Path, origin: Origin) -> bytes:
    """Return the content of a download, or of the file that is meant in an archive.

    Raises
    ------
    NotAsPublished
        If it is no archive, or the file is not in it.
    """
    content = part.read_bytes()
    if origin.member is None:
        return content
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            inside = [name for name in archive.namelist() if Path(name).name == origin.member]
            if len(inside) != 1:
                raise NotAsPublished(f"expected {origin.member} once in the archive, got {archive.namelist()}")
            return archive.read(inside[0])
    except zipfile.BadZipFile as error:
        raise NotAsPublished(f"expected a zip archive, got {content[:40]!r}") from error


def _by_hand(entry: RecordingEntry, path: Path, why: str) -> str:
    origin = entry.origin
    steps = [f"open {origin.page}" if origin.url is None else f"open {origin.url} (of {origin.page})"]
    if origin.member is not None:
        steps.append(f"take {origin.member} out of the archive")
    if origin.convert is Conversion.NONE:
        steps.append(f"put it at {path}")
    else:
        steps.append(f"run python -m hil.proof.real.convert {origin.convert.value} FILE {path}")
    lines = [f"{entry.path}: not downloaded: {why}", f"  By hand: {', '.join(steps)}.", f"  SHA-256 {entry.sha256}"]
    return "\n".join(lines)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m hil.proof.real.download",
        description="Download the public recordings from where they are published, checked.",
        epilog="Example: python -m hil.proof.real.download --to recordings emps friction_joint",
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="cases (default: all)")
    parser.add_argument("--to", required=True, type=Path, metavar="DIR", help="data folder; made where missing")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Download; return the exit status: 2 where something could not be had."""
    parser = _parser()
    options = parser.parse_args(arguments)

    def tell(line: str) -> None:
        sys.stdout.write(line + "\n")
        sys.stdout.flush()

    try:
        failed = download(wanted(options.names).values(), options.to, tell)
    except HilError as error:
        parser.error(str(error))
    except KeyboardInterrupt:
        return _INTERRUPTED
    for message in failed:
        sys.stderr.write(message + "\n")
    return _FAILED if failed else 0


if __name__ == "__main__":
    sys.exit(main())
