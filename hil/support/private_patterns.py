"""What private things look like in a text: the patterns behind `hil.support.redact`."""

from __future__ import annotations

import re
from typing import Final

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
