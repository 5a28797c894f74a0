"""Mutants of a file or of frames: what bad disks, cut transfers, other programs and people make of them.

A mutant follows from its random numbers alone, so that any of them can be made again.
"""

import random
import struct
from collections.abc import Callable, Sequence

BYTES = (
    *(bytes([value]) for value in (0x00, 0x01, 0x20, 0x7F, 0x80, 0xFF)),
    *(struct.pack("<H", value) for value in (0, 0x7FFF, 0x8000, 0xFFFF)),
    *(struct.pack("<I", value) for value in (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)),
    *(struct.pack("<Q", value) for value in (1, 1 << 31, 1 << 32, (1 << 63) - 1, 1 << 63, (1 << 64) - 1)),
    *(struct.pack("<d", value) for value in (0.0, float("nan"), float("inf"), 1e300, 5e-324)),
)
"""Values at the edges of the types that binary formats have."""

TOKENS = tuple(
    text.encode()
    for text in (
        *(
            "",
            "0",
            "-1",
            "1e400",
            "-1e-400",
            "nan",
            "inf",
            "9" * 400,
            "0x" + "f" * 40,
            "1.0.0",
            "0777",
            "1_000",
            "2.5e",
        ),
        *("true", "null", "None", "[]", "{}", '""', "[" * 2000, "{" * 2000, '{"a":' * 1500, "]", "}", '"', "'", '"""'),
        *("\n", "\r", "\r\n", "\t", ",", ";", "=", "#", "\\", "\\u0000", "\\ud800", "$NODEID", "$NODEID+", "%s", "\0"),
        *("../../etc/passwd", "/dev/zero", "http://[", "A" * 5000, "\ufeff", "\u202e", "\U0001f600", "²", "٣", "1,5"),
    )
)
"""What people, spreadsheets and generators put into texts."""

Change = Callable[[bytes, random.Random], bytes]


def mutant(seeds: Sequence[bytes], dice: random.Random, text: bool) -> bytes:
    """Change one of the seeds in one to eight places."""
    data = dice.choice(seeds)
    for _ in range(dice.choice((1, 1, 1, 2, 3, 8))):
        change = dice.choice(_OF_TEXTS if text and dice.random() < 0.8 else _OF_BYTES)
        data = change(data, dice) if dice.random() > 0.05 else _spliced(data, dice.choice(seeds), dice)
    return data


def _place(data: bytes, dice: random.Random) -> int:
    """Draw a place, every fourth time near the beginning or the end: there are the headers."""
    edge = min(len(data), 64)
    near = dice.choice((0, 0, 0, 1, 2))
    if near == 1:
        return dice.randrange(edge + 1)
    return len(data) - dice.randrange(edge + 1) if near == 2 else dice.randrange(len(data) + 1)


def _put(data: bytes, start: int, end: int, new: bytes) -> bytes:
    return data[:start] + new + data[end:]


def _length(dice: random.Random) -> int:
    return dice.randrange(1, 1 << dice.randrange(1, 8))


def _flip(data: bytes, dice: random.Random) -> bytes:
    at = _place(data, dice)
    return _put(data, at, at + 1, bytes(each ^ 1 << dice.randrange(8) for each in data[at : at + 1]))


def _overwrite(data: bytes, dice: random.Random) -> bytes:
    at, new = _place(data, dice), dice.choice(BYTES)
    return _put(data, at, at + len(new), new if dice.random() < 0.7 else new[::-1])


def _noise(data: bytes, dice: random.Random) -> bytes:
    at, length = _place(data, dice), _length(dice)
    return _put(data, at, at + length, dice.randbytes(length))


def _cut(data: bytes, dice: random.Random) -> bytes:
    return data[: _place(data, dice)]


def _remove(data: bytes, dice: random.Random) -> bytes:
    at = _place(data, dice)
    return _put(data, at, at + _length(dice), b"")


def _insert(data: bytes, dice: random.Random) -> bytes:
    at = _place(data, dice)
    return _put(data, at, at, dice.choice((*BYTES, dice.randbytes(_length(dice)))))


def _repeat(data: bytes, dice: random.Random) -> bytes:
    at = _place(data, dice)
    part = data[at : at + _length(dice)]
    return _put(data, at, at, part * dice.choice((1, 2, 50)))


def _spliced(data: bytes, other: bytes, dice: random.Random) -> bytes:
    return data[: _place(data, dice)] + other[_place(other, dice) :]


def _words(data: bytes) -> list[tuple[int, int]]:
    """Cut a text at its delimiters."""
    ends, start = [], 0
    for at, each in enumerate(data):
        if each in b" \t\r\n,;=:[]{}()\"'#":
            if at > start:
                ends.append((start, at))
            start = at + 1
    return [*ends, (start, len(data))]


def _other_word(data: bytes, dice: random.Random) -> bytes:
    words = _words(data)
    start, end = dice.choice(words)
    first, last = dice.choice(words)
    return _put(data, start, end, dice.choice((*TOKENS, data[first:last])))


def _number(data: bytes, dice: random.Random) -> bytes:
    numbers = [(start, end) for start, end in _words(data) if any(each in b"0123456789" for each in data[start:end])]
    if not numbers:
        return _other_word(data, dice)
    start, end = dice.choice(numbers)
    new = dice.choice((b"0", b"-1", b"1e300", b"1e-300", b"nan", b"65536", b"4294967296", b"1e6", b"0.5", b"-0", b"7"))
    return _put(data, start, end, new)


def _line(data: bytes, dice: random.Random) -> bytes:
    """Take a line away, double it, change two, or put it into another's place."""
    lines = data.split(b"\n")
    one, two = dice.randrange(len(lines)), dice.randrange(len(lines))
    match dice.randrange(4):
        case 0:
            lines.pop(one)
        case 1:
            lines.insert(two, lines[one])
        case 2:
            lines[one], lines[two] = lines[two], lines[one]
        case _:
            lines[one] = lines[two]
    return b"\n".join(lines)


def _token(data: bytes, dice: random.Random) -> bytes:
    at = _place(data, dice)
    return _put(data, at, at, dice.choice(TOKENS))


_OF_BYTES: tuple[Change, ...] = (_flip, _flip, _overwrite, _overwrite, _noise, _cut, _remove, _insert, _repeat)
_OF_TEXTS: tuple[Change, ...] = (_other_word, _other_word, _number, _number, _line, _line, _token)
