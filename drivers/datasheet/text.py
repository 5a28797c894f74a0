"""The text of an EDS: sections and keys with their line numbers, as they stand in the file, and remarks on them.

What can't be an EDS at all is refused. Everything else is read as well as can be, and what was odd about it
is kept as findings: vendors' files have duplicate keys, stray lines, other encodings. Of two keys or sections
of one name the first counts, as it does for the Windows functions that most EDS tools are built on.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from drivers.errors import ConfigMismatch
from drivers.foreign_file import read_regular

ADVICE = "Take the file from the drive's maker."
NO_EDS = f"Expected an EDS as CiA 306 has it. {ADVICE}"
MAX_BYTES = 16 << 20  # a drive's EDS has some 100 kB; a wrong file shall not fill the memory
MAX_LINE_LENGTH = 255  # characters in a line of an EDS (CiA 306)

_DCF_SUFFIX = ".dcf"
COMMISSIONING = ("DeviceComissioning", "DeviceCommissioning")
"""Section of a DCF; CiA 306 spells it the first way."""

_UTF_16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_UTF_8_MARK = b"\xef\xbb\xbf"
_LINE_ENDS = re.compile(r"\r\n|\n|\r")
_MANUFACTURER = re.compile(r"[2-5][0-9a-f]{3}(sub[0-9a-f]+)?$", re.IGNORECASE)
"""Sections of the maker's own objects, which this program does not use."""

_INLINE_COMMENT = re.compile(r"\s;")


class Severity(Enum):
    """How bad a remark is."""

    ERROR = "error"
    """This program needs it, or CiA 306 forbids it and it changes what the file says."""

    WARNING = "warning"
    """Not as CiA 306 has it, but vendors do it and this program copes, or does not use the object."""

    NOTE = "note"
    """Nothing is wrong for this program; another tool may think otherwise."""


@dataclass(frozen=True, slots=True)
class EdsFinding:
    """One remark."""

    severity: Severity  # how bad it is
    line: int | None  # line of the file, from 1; None if it concerns the file as a whole
    place: str  # section, and key if it concerns one
    expected: str  # what should stand there, in words
    found: str  # what stands there, in words
    advice: str  # what to do, as a sentence

    def __str__(self) -> str:
        return f"{self.place}: expected {self.expected}, found {self.found}. {self.advice}"


class EdsUnreadable(ConfigMismatch):
    """A file whose text can't be read at all."""

    def __init__(self, path: Path, found: str, advice: str = ADVICE) -> None:
        self.found = found
        self.advice = advice
        super().__init__(f"EDS {path} can't be read: {found}. Expected an EDS as CiA 306 has it. {advice}")


@dataclass(frozen=True, slots=True)
class EdsKey:
    """One ``name=value`` and its line."""

    name: str  # left of the equals sign, as written
    value: str  # right of it, as written
    line: int  # from 1


@dataclass(frozen=True, slots=True)
class EdsSection:
    """One section: its name as written, its line, its keys by lower-case name."""

    name: str  # as written
    line: int  # from 1
    keys: dict[str, EdsKey] = field(default_factory=dict)  # by lower-case name

    def get(self, key: str) -> str | None:
        """Look up a key's value, whatever its case; None if it is missing or blank."""
        found = self.keys.get(key.lower())
        return (found.value or None) if found is not None else None

    def line_of(self, key: str) -> int:
        """Line of a key; that of the section if there is no such key."""
        found = self.keys.get(key.lower())
        return self.line if found is None else found.line


@dataclass(frozen=True, slots=True)
class EdsText:
    """A file's sections by lower-case name, in the order of the file, and what is odd about its text."""

    path: Path  # of the file
    sections: dict[str, EdsSection]  # by lower-case name
    findings: tuple[EdsFinding, ...]  # about encoding and form

    def section(self, name: str) -> EdsSection | None:
        """Look up a section, whatever its case."""
        return self.sections.get(name.lower())

    @property
    def commissioning(self) -> EdsSection | None:
        """What a DCF says of the node it is for."""
        found = (self.section(name) for name in COMMISSIONING)
        return next((section for section in found if section is not None), None)

    @property
    def is_dcf(self) -> bool:
        """Whether it describes one commissioned device (CiA 306), by its name or by the section that only such has."""
        return self.path.suffix.lower() == _DCF_SUFFIX or self.commissioning is not None


def read_eds_text(path: Path) -> EdsText:
    """Read a file's sections and keys, whatever its encoding and ends of lines; what is odd becomes findings."""
    text, findings = _decode(path)
    reader = _Reader()
    reader.findings.extend((*findings, *_ends_of_lines(text)))
    for number, line in enumerate(_LINE_ENDS.split(text), start=1):
        reader.take(number, line)
    return EdsText(path, reader.sections, tuple(reader.findings))


def _decode(path: Path) -> tuple[str, list[EdsFinding]]:
    try:
        data = read_regular(path, MAX_BYTES)
    except OSError as error:
        raise EdsUnreadable(path, str(error.strerror)) from error
    if data.startswith(_UTF_16_MARKS):
        raise EdsUnreadable(path, "UTF-16 text", "Save it as ANSI or ASCII text.")
    if b"\0" in data:
        line = data[: data.index(b"\0")].count(b"\n") + 1
        raise EdsUnreadable(path, f"no text, for there is a byte 0 in line {line}")
    findings = []
    if data.startswith(_UTF_8_MARK):
        data = data.removeprefix(_UTF_8_MARK)
        findings.append(
            EdsFinding(Severity.WARNING, 1, "text", "ASCII", "a UTF-8 byte order mark", "Save it without the mark.")
        )
    return data.decode("latin-1"), findings


def _ends_of_lines(text: str) -> Iterator[EdsFinding]:
    ends = _LINE_ENDS.findall(text)
    kinds = {end.replace("\r", "CR ").replace("\n", "LF").strip() for end in ends}
    if len(kinds) > 1:
        line = next(n for n, end in enumerate(ends, start=1) if end != ends[0])
        found = f"{' and '.join(sorted(kinds))} mixed, first here"
        yield EdsFinding(Severity.NOTE, line, "text", "one kind of line end", found, "Save it with one kind.")
    elif kinds == {"CR"}:
        advice = "Save it with CR LF, which every tool reads."
        yield EdsFinding(Severity.WARNING, 1, "text", "lines that end with CR LF or LF", "CR alone", advice)


class _Reader:
    """Takes line after line."""

    def __init__(self) -> None:
        self.sections: dict[str, EdsSection] = {}
        self.findings: list[EdsFinding] = []
        self._here: EdsSection | None = None
        self._seen_foreign = False

    def take(self, number: int, line: str) -> None:
        stripped = line.strip()
        if len(line) > MAX_LINE_LENGTH:
            self._note(number, f"at most {MAX_LINE_LENGTH} characters in a line", str(len(line)), "Shorten it.")
        if not line.isascii() and not self._seen_foreign:
            self._seen_foreign = True
            self._note(number, "ASCII", "other characters, first here", "Nothing to do unless a name looks odd.")
        if not stripped or stripped.startswith(";"):
            return
        if stripped.startswith("#"):
            self._warn(number, "a comment that begins with ;", "one with #", "It is left out; write ; instead.")
        elif stripped.startswith("["):
            self._take_header(number, stripped)
        else:
            self._take_key(number, stripped)

    def _take_header(self, number: int, line: str) -> None:
        name, closed, rest = line[1:].partition("]")
        name = name.strip()
        if not closed or not name:
            self._here = EdsSection(line, number)  # what follows belongs to no section that can be named
            self._err(number, "a section such as [1000]", repr(line), "Write its name between [ and ].")
            return
        if rest.strip() and not rest.strip().startswith(";"):
            self._warn(number, f"nothing after [{name}]", repr(rest.strip()), "It is left out.")
        known = self.sections.get(name.lower())
        if known is None:
            known = self.sections[name.lower()] = EdsSection(name, number)
        else:
            found = f"a second one; the first is in line {known.line}"
            advice = "Keep one; where both have a key, the first counts."
            self._warn(number, "one section of a name", found, advice, f"[{name}]")
        self._here = known

    def _take_key(self, number: int, line: str) -> None:
        name, equals, value = (part.strip() for part in line.partition("="))
        if self._here is None:
            self._warn(number, "a section before it", repr(line), "It is left out; put it under its section.")
            return
        place = f"[{self._here.name}]"
        if not equals or not name:
            self._warn(number, "key=value", repr(line), "It is left out; fix the line.", place)
            return
        value = _INLINE_COMMENT.split(value, maxsplit=1)[0].strip()
        value = "" if value.startswith(";") else value
        known = self._here.keys.setdefault(name.lower(), EdsKey(name, value, number))
        if known.line != number:
            self._second_key(known, EdsKey(name, value, number), f"{place} {name}")

    def _second_key(self, first: EdsKey, second: EdsKey, place: str) -> None:
        expected = f"this key once; line {first.line} has it with {first.value!r}"
        if first.value == second.value:
            self._warn(second.line, expected, "it again", "Take one out.", place)
        elif self._here is not None and _MANUFACTURER.match(self._here.name):
            self._warn(second.line, expected, f"it again with {second.value!r}", "The first counts.", place)
        else:
            self._err(second.line, expected, f"it again with {second.value!r}", "Keep the right one.", place)

    def _err(self, line: int, expected: str, found: str, advice: str, place: str = "text") -> None:
        self.findings.append(EdsFinding(Severity.ERROR, line, place, expected, found, advice))

    def _warn(self, line: int, expected: str, found: str, advice: str, place: str = "text") -> None:
        self.findings.append(EdsFinding(Severity.WARNING, line, place, expected, found, advice))

    def _note(self, line: int, expected: str, found: str, advice: str) -> None:
        self.findings.append(EdsFinding(Severity.NOTE, line, "text", expected, found, advice))
