"""One file over HTTP: resumed where it broke off, whole or not at all."""

from __future__ import annotations

import http.client
import urllib.error
import urllib.request
from pathlib import Path

TIMEOUT_S = 30.0
CHUNK_BYTES = 1 << 16

PARTIAL_CONTENT = 206
RANGE_NOT_SATISFIABLE = 416


class FetchFailed(Exception):
    """A file could not be had; what was is kept, and the next try continues from there."""


def fetch(url: str, part: Path) -> None:
    """Fetch a URL into a file; what the file holds already is not fetched again, if the server can do that.

    Raises
    ------
    FetchFailed
        If there is no connection, the server refuses, or the transfer breaks off.
    """
    have = part.stat().st_size if part.exists() else 0
    request = urllib.request.Request(url, headers={"Range": f"bytes={have}-"} if have else {})
    try:
        with urllib.request.urlopen(request, timeout=TIMEOUT_S) as answer:
            resumed = have > 0 and answer.status == PARTIAL_CONTENT
            _write(answer, part, resumed)
    except urllib.error.HTTPError as error:
        if error.code == RANGE_NOT_SATISFIABLE:
            return  # nothing is left to fetch; the checksum will tell whether it is the right thing
        raise FetchFailed(f"{url}: expected the file, the server says {error.code} {error.reason}") from error
    except (OSError, http.client.HTTPException, ValueError) as error:
        raise FetchFailed(f"{url}: expected a connection, got: {error}") from error


def _write(answer: http.client.HTTPResponse, part: Path, resumed: bool) -> None:
    left = answer.headers.get("Content-Length")
    expected = None if left is None else int(left)
    got = 0
    with part.open("ab" if resumed else "wb") as file:
        while chunk := answer.read(CHUNK_BYTES):
            file.write(chunk)
            got += len(chunk)
    if expected is not None and got < expected:
        raise FetchFailed(f"{answer.url}: expected {expected} bytes, the connection broke off after {got}. Try again.")
