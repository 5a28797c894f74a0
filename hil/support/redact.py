"""Takes out of a text what is nobody else's business: secrets, and where on a disk things are.

Taken out are, in this order: PEM blocks; tokens of HTTP headers; values of keys and options whose name says secret
(password, pass, auth, token, key, ca, certificate, ...), user or comment; user, password and token in a URL; the
folders of absolute paths (the file's name stays, and so do paths inside this program); names of the user and of the
machine. What it takes out it marks, so that a reader sees that something was there. Too much is better than too little:
a value after ``key`` goes even where it was harmless.
"""

from __future__ import annotations

import getpass
import os
import platform
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

_WORDS: Final = "passw|passphrase|passcode|pwd|auth|bearer|secret|token|credential|api_?key|user_?name"
"""A name with one of these in it is that of a secret."""

_ENDS: Final = "key|psk|cert|certificate|pass|pin|user|login|operator|comment|note"
"""And so is a name that is, or ends in, one of these: ``key``, ``private_key``, ``key_file``, but not ``keyboard``; who
works with it and what they wrote is as private."""

SECRET_NAME: Final = re.compile(rf"(?:[\w-]*(?:{_WORDS})[\w-]*|(?:[\w-]*[_-])?(?:{_ENDS})(?:[_-]file)?|ca)", re.I)

_VALUE: Final = (
    r"(?:"
    r"\"{3}.*?\"{3}|'{3}.*?'{3}"  # TOML texts over several lines
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
    r"|\[[^\]]*\]"
    r"|[^\s,;}\])#&\"']+"
    r")"
)

ASSIGNED: Final = re.compile(
    rf"(?<![\w.-])(?P<name>[\"']?{SECRET_NAME.pattern}[\"']?\s*[=:]\s*)(?P<value>{_VALUE})", re.I | re.S
)
"""``name = value`` of TOML, ``"name": value`` of JSON, ``name=value`` of a URL."""

OPTION: Final = re.compile(rf"(?P<name>--{SECRET_NAME.pattern}[ =])(?P<value>{_VALUE})", re.I | re.S)
"""``--name value`` of a command line."""

PEM: Final = re.compile(r"-----BEGIN [^-\n]+-----.*?(?:-----END [^-\n]+-----|\Z)", re.S)

URL_USER: Final = re.compile(r"(?<=://)[^\s\"']+@")
"""``user:password@``; a password may hold an ``@`` or a ``/`` itself."""

BUS_TOKEN: Final = re.compile(r"(?P<server>wss?://[^/\s\"']+/)[\w-]{20,}")
"""The token in the URL of a served bus."""

AUTHORISATION: Final = re.compile(r"\b(?P<scheme>bearer|basic|digest)\s+(?=\S*(?-i:[0-9A-Z=.]))[\w.~+/=-]{6,}", re.I)
"""``Bearer TOKEN`` and its like, of a header."""

TOML_TEXT_OR_COMMENT: Final = re.compile(
    r"\"{3}.*?\"{3}|'{3}.*?'{3}|\"(?:\\.|[^\"\\\n])*\"|'[^'\n]*'|(?P<comment>[ \t]*#[^\n]*)", re.S
)
"""The texts of a TOML file, in which ``#`` is no comment, and its comments."""

QUOTED_PATH: Final = re.compile(r"""(?P<quote>["'])(?P<path>(?:/|[A-Za-z]:[\\/]|\\\\)[^"'\n]+)(?P=quote)""")

PATH: Final = re.compile(
    r"""(?<![\w:/.\\\]~<>])(?:(?:/[^\s/"',;:()\[\]<>|]+){2,}|(?:[A-Za-z]:|\\)\\[^\s"',;()\[\]<>|]+)/?"""
)
"""An absolute path of two parts or more; what follows a word or a colon is a unit or part of a URL."""


REMOVED: Final = "[removed]"
FOLDER: Final = "[folder]"

PACKAGES: Final = Path(__file__).resolve().parents[2]
"""Where the packages of this program are."""

COMMON_NAMES: Final = frozenset({"root", "user", "users", "home", "admin", "localhost", "default", "hil", "test"})
"""Names that tell nothing of anyone, and are words of other things."""


@dataclass(slots=True)
class Redaction:
    """Takes out, and counts what it took out."""

    # folders that are kept by a mark, such as <python>, by their paths; the longest first
    places: Mapping[str, str] = field(default_factory=lambda: dict(_places()))
    # what stands in place of the names of user and machine
    names: Mapping[str, str] = field(default_factory=lambda: dict(_names()))
    counts: Counter[str] = field(default_factory=Counter)  # how often each kind was taken out

    def text(self, text: str) -> str:
        """Return a text without what is private."""
        text = self.secrets(text)
        text = self._sub("folders", QUOTED_PATH, self._quoted, text)
        text = self._sub("folders", PATH, lambda match: self._path(match[0]), text)
        return self._without_names(text)

    def secrets(self, text: str) -> str:
        """Return a text without secrets, where folders and names may stay: a file of the user's own."""
        text = self._sub("PEM blocks", PEM, lambda _: REMOVED, text)
        text = self._sub("secret values", AUTHORISATION, lambda match: f"{match['scheme']} {REMOVED}", text)
        for pattern in (ASSIGNED, OPTION):
            text = self._sub("secret values", pattern, lambda match: f'{match["name"]}"{REMOVED}"', text)
        text = self._sub("users in URLs", URL_USER, lambda _: f"{REMOVED}@", text)
        return self._sub("tokens in URLs", BUS_TOKEN, lambda match: f"{match['server']}{REMOVED}", text)

    def toml(self, text: str) -> str:
        """Return a TOML file's text the same way as `text`, and without what people wrote next to its keys."""
        return self.text(self._sub("comments", TOML_TEXT_OR_COMMENT, _without_comment, text))

    def document(self, value: Any, name: str = "") -> Any:
        """Return a JSON document the same way: each of its texts, and whatever stands under a secret name."""
        if isinstance(value, Mapping):
            return {self.text(str(key)): self.document(part, str(key)) for key, part in value.items()}
        if isinstance(value, (list, tuple)):
            return [self.document(part, name) for part in value]
        if SECRET_NAME.fullmatch(name):
            self.counts["secret values"] += 1
            return REMOVED
        return self.text(value) if isinstance(value, str) else value

    def _without_names(self, text: str) -> str:
        for name, mark in self.names.items():
            found = re.compile(rf"(?<!\w){re.escape(name)}(?!\w)")
            self.counts["names"] += len(found.findall(text))
            text = found.sub(mark, text)
        return text

    def _sub(self, kind: str, pattern: re.Pattern[str], by: Callable[[re.Match[str]], str], text: str) -> str:
        def counted(match: re.Match[str]) -> str:
            new = by(match)
            self.counts[kind] += new != match[0]
            return new

        return pattern.sub(counted, text)

    def _quoted(self, match: re.Match[str]) -> str:
        return f"{match['quote']}{self._path(match['path'])}{match['quote']}"

    def _path(self, path: str) -> str:
        for place, mark in self.places.items():
            if path == place or path.startswith((f"{place}/", f"{place}\\")):
                return mark + path[len(place) :]
        parts = path.replace("\\", "/").rstrip("/")
        return f"{FOLDER}/{parts.rpartition('/')[2]}"


def _without_comment(match: re.Match[str]) -> str:
    return "" if match["comment"] is not None else match[0]


def _places() -> Iterator[tuple[str, str]]:
    found = {str(PACKAGES / name): f"<{name}>" for name in ("hil", "drivers", "estimator")}
    found |= {str(Path(prefix)): "<python>" for prefix in (sys.prefix, sys.base_prefix) if len(Path(prefix).parts) > 1}
    yield from sorted(found.items(), key=lambda item: -len(item[0]))


def _names() -> Iterator[tuple[str, str]]:
    users = {
        _user(),
        Path.home().name,
        *(os.environ.get(each, "") for each in ("USER", "LOGNAME", "SUDO_USER", "USERNAME")),
    }
    for name, mark in (*((user, "[user]") for user in sorted(users)), (platform.node(), "[host]")):
        if len(name) > 2 and name.lower() not in COMMON_NAMES:
            yield name, mark


def _user() -> str:
    """Return the user's name; empty for a process that has none in the password file."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return ""
