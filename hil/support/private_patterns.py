"""What private things look like in a text: the patterns behind `hil.support.redact`."""

from __future__ import annotations

import re
from typing import Final

_WORDS: Final = "password|passwd|passphrase|secret|token|credential|api_?key"
"""A name with one of these in it is that of a secret."""

_ENDS: Final = "key|psk|cert|certificate"
"""And so is a name that is, or ends in, one of these: ``key``, ``private_key``, ``key_file``, but not ``keyboard``."""

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

URL_USER: Final = re.compile(r"(?<=://)[^/\s\"']+@")
"""``user:password@``; a password may hold an ``@`` itself."""

QUOTED_PATH: Final = re.compile(r"""(?P<quote>["'])(?P<path>(?:/|[A-Za-z]:[\\/]|\\\\)[^"'\n]+)(?P=quote)""")

PATH: Final = re.compile(
    r"""(?<![\w:/.\\\]~<>])(?:(?:/[^\s/"',;:()\[\]<>|]+){2,}|(?:[A-Za-z]:|\\)\\[^\s"',;()\[\]<>|]+)/?"""
)
"""An absolute path of two parts or more; what follows a word or a colon is a unit or part of a URL."""
