"""``python -m tests.campaigns.download --to DIR [NAME...]``: the real recordings, from where they are published.

Every file is checked against its SHA-256 before it takes its place; one that is there and right is not fetched again.
Where a file can't be had, the message says what to download by hand and where to put it; ``--from FILE`` takes one that
was, and converts it where that is needed.
"""

import argparse
import hashlib
import http.client
import io
import json
import sys
import urllib.request
import zipfile
from collections.abc import Sequence
from pathlib import Path

from hil.errors import HilError
from hil.proof.real_files import Conversion, Origin, RecordingEntry, case_folders, read_case, sha256_of

TIMEOUT_S = 30.0

M_PER_INCH = 0.0254
N_PER_KIP = 4448.2216152605
"""1000 pounds of 0.45359237 kg under 9.80665 m/s^2."""

HEADER = "time_s,displacement_m,velocity_m_s,force_n"


class NotToBeHad(Exception):
    """A recording could not be downloaded, or is not what its publishers describe."""


def wanted(names: Sequence[str]) -> dict[str, RecordingEntry]:
    """Return the recordings of cases, each file once, by its place in the data folder."""
    folders = case_folders(list(names)).values()
    return {entry.path: entry for folder in folders for entry in read_case(folder).recordings.values()}


def recording_of(published: bytes, origin: Origin) -> bytes:
    """Return the recording of what is published: a file of an archive, converted to CSV in SI units."""
    try:
        if origin.member is not None:
            with zipfile.ZipFile(io.BytesIO(published)) as archive:
                (inside,) = (name for name in archive.namelist() if Path(name).name == origin.member)
                published = archive.read(inside)
        if origin.convert is Conversion.FRICTION_DAMPER:
            published = _friction_damper(published)
    except (ValueError, KeyError, TypeError, IndexError, zipfile.BadZipFile) as error:
        raise NotToBeHad(f"not in the form that is published: {published[:40]!r} ({error})") from error
    return published


def _friction_damper(content: bytes) -> bytes:
    """Convert ``{"data": [[time s, displacement in, friction force kip, velocity in/s, ...], ...]}``."""
    lines = [
        f"{row[0]:.7f},{row[1] * M_PER_INCH:.7g},{row[3] * M_PER_INCH:.6g},{row[2] * N_PER_KIP:.6g}"
        for row in json.loads(content)["data"]
    ]
    return ("\n".join([HEADER, *lines]) + "\n").encode("ascii")


def have(entry: RecordingEntry, to: Path, published: bytes | None = None) -> str:
    """Have one recording in the data folder; return how."""
    path = to / entry.path
    if path.exists() and sha256_of(path) == entry.sha256:
        return "there already"
    content = recording_of(_fetched(entry.origin) if published is None else published, entry.origin)
    if (got := hashlib.sha256(content).hexdigest()) != entry.sha256:
        raise NotToBeHad(f"expected the SHA-256 {entry.sha256}, got {got}")
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part")
    part.write_bytes(content)
    part.replace(path)
    return f"from {entry.origin.url}" if published is None else "from the file given"


def _fetched(origin: Origin) -> bytes:
    if origin.url is None:
        raise NotToBeHad("its page asks for an account")
    try:
        with urllib.request.urlopen(origin.url, timeout=TIMEOUT_S) as answer:
            content: bytes = answer.read()
    except (OSError, http.client.HTTPException, ValueError) as error:
        raise NotToBeHad(f"{origin.url}: {error}") from error
    return content


def main(arguments: Sequence[str] | None = None) -> int:
    """Download; return the exit status: 2 where something could not be had."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.download", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="cases (default: all)")
    parser.add_argument("--to", required=True, type=Path, metavar="DIR", help="data folder; made where missing")
    parser.add_argument("--from", type=Path, dest="published", metavar="FILE", help="downloaded by hand, of --as")
    parser.add_argument("--as", dest="place", metavar="PATH", help="which recording it is, as this program names it")
    options = parser.parse_args(arguments)
    try:
        entries = wanted(options.names)
    except HilError as error:
        parser.error(str(error))
    if (options.published is None) != (options.place is None) or options.place not in (None, *entries):
        parser.error(f"--from FILE and --as PATH: expected both, with one of {', '.join(entries)}")
    published = None if options.published is None else options.published.read_bytes()
    failed = 0
    for path, entry in entries.items():
        if options.place in (None, path):
            try:
                sys.stdout.write(f"{path}: {have(entry, options.to, published)}\n")
            except NotToBeHad as error:
                failed += 1
                sys.stderr.write(f"{path}: not downloaded: {error}\n  By hand from {entry.origin.page}, then --from\n")
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
