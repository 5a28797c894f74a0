"""A look into a recording of any format: in the process that reads it, where its parser is a compiled library."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hil.recording.apart import READER
from hil.recording.format_hints import FormatHints
from hil.recording.formats import format_of
from hil.recording.look.roles import Roles, roles_of
from hil.recording.look.signals_text import signals_lines
from hil.recording.look.survey import Survey, survey_of
from hil.recording.request import Request
from hil.recording.text.encoding import FALLBACK, likely_encoding


@dataclass(frozen=True, slots=True)
class Look:
    """What is in a recording, what its channels could be, and the table that reads it."""

    path: Path
    survey: Survey
    roles: Roles
    signals: tuple[str, ...]


def look(path: Path, dbc: Path | None = None) -> Look:
    """Look into a recording."""
    known = format_of(path)
    encoding = None
    if known.apart:
        survey = READER.survey(path, Request(dbc=dbc))
    else:
        encoding = likely_encoding(path.read_bytes())
        survey = survey_of([known.read(path, Request(FormatHints(encoding=encoding)))])
    roles = roles_of(survey.groups)
    by_hand = encoding if encoding == FALLBACK else None
    return Look(path, survey, roles, tuple(signals_lines(survey, roles, by_hand)))
