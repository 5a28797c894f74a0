"""Vector's BLF by python-can's reader, which trusts every length in the file: here each is checked before it is used.

A BLF is a row of containers, each a part of the log packed by zlib; an object may continue in the next container. One
megabyte of them can unpack to gigabytes, and an object of length 0 is one that a reader never leaves.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from typing import Any, BinaryIO, Final

from can.io.blf import (
    LOG_CONTAINER,
    LOG_CONTAINER_STRUCT,
    NO_COMPRESSION,
    OBJ_HEADER_BASE_STRUCT,
    ZLIB_DEFLATE,
    BLFParseError,
    BLFReader,
)

from drivers.canopen import can

CONTAINER_BYTES: Final = 16 << 20
"""A container holds 128 KiB in files of Vector and of python-can."""

FLOOR_BYTES: Final = 32 << 20
UNPACKED_PER_BYTE: Final = 64
"""What a whole file may unpack to: a floor, and for large files a multiple of their size; frames pack tenfold."""

HEADER_BYTES: Final = OBJ_HEADER_BASE_STRUCT.size


class BoundedBlfReader(BLFReader):
    """Gives the frames of a BLF.

    Raises
    ------
    BLFParseError
        While reading, where a length in the file can't be one, or it unpacks to more than a log of its size does.
    """

    def __init__(self, file: BinaryIO, **kwargs: Any) -> None:
        file.seek(0, 2)
        self._left = max(FLOOR_BYTES, UNPACKED_PER_BYTE * file.tell())
        file.seek(0)
        super().__init__(file, **kwargs)

    def __iter__(self) -> Iterator[can.Message]:  # type: ignore[override]  # nothing is sent into it
        while header := self.file.read(HEADER_BYTES):
            signature, _, _, size, kind = OBJ_HEADER_BASE_STRUCT.unpack(header)
            if signature != b"LOBJ" or size < HEADER_BYTES:
                raise BLFParseError(f"expected an object, got {signature!r} of {size} bytes")
            content = self.file.read(size - HEADER_BYTES)
            self.file.read(size % 4)
            if kind == LOG_CONTAINER:
                yield from self._parse_container(self._unpacked(content))
        self.stop()

    def _unpacked(self, content: bytes) -> bytes:
        method, _ = LOG_CONTAINER_STRUCT.unpack_from(content)
        packed = content[LOG_CONTAINER_STRUCT.size :]
        if method == NO_COMPRESSION:
            data = packed
        elif method == ZLIB_DEFLATE:
            unpacking = zlib.decompressobj()
            data = unpacking.decompress(packed, CONTAINER_BYTES)
            if unpacking.unconsumed_tail:
                raise BLFParseError(f"expected containers of at most {CONTAINER_BYTES} bytes, got a larger one")
        else:
            raise BLFParseError(f"expected a container packed by zlib or not at all, got method {method}")
        self._left -= len(data)
        if self._left < 0:
            raise BLFParseError("expected a log, got a file that unpacks to far more than one of its size")
        return data

    def _parse_container(self, data: bytes) -> Iterator[can.Message]:
        if len(self._tail) > CONTAINER_BYTES:
            raise BLFParseError("expected objects that end, got one that is longer than any")
        _require_lengths(self._tail + data)
        yield from super()._parse_container(data)


def _require_lengths(data: bytes) -> None:
    """See that every object whose header is there leads on to the next."""
    at = data.find(b"LOBJ", 0, 8)
    while 0 <= at <= len(data) - HEADER_BYTES:
        size = OBJ_HEADER_BASE_STRUCT.unpack_from(data, at)[3]
        if size < HEADER_BYTES:
            raise BLFParseError(f"expected an object of {HEADER_BYTES} bytes or more, got one of {size}")
        at = data.find(b"LOBJ", at + size, at + size + 8)
