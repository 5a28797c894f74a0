"""What is in a recording, in Python."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hil.recording.look import CHANNEL_HEADINGS, Look, channel_rows
from hil.recording.look import look as look_into
from hil.report import page as html

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, slots=True)
class LookResult:
    """Channels of a recording, and the table that reads it; ``found`` holds all of it."""

    found: Look

    @property
    def signals(self) -> str:
        """The lines of ``[signals]`` that read it; empty where none are needed."""
        return "\n".join(self.found.signals)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a row per channel."""
        import pandas

        rows = [row for group in self.found.survey.groups for row in channel_rows(group)]
        return pandas.DataFrame(rows, columns=list(CHANNEL_HEADINGS)).set_index("channel")

    def __repr__(self) -> str:
        roles = self.found.roles
        torques = ", ".join(guess.channel.name for guess in roles.torques) or "none found"
        output = "none found" if roles.output is None else roles.output.channel.name
        count = sum(len(group.channels) for group in self.found.survey.groups)
        return f"<{self.found.path.name}: {count} channels; torque {torques}; output {output}>"

    def _repr_html_(self) -> str:
        rows = [tuple(map(str, row)) for group in self.found.survey.groups for row in channel_rows(group)]
        lines = [html.paragraph(line) for line in self.found.signals]
        return html.fragment(html.Heading(repr(self)[1:-1]), html.table(CHANNEL_HEADINGS, rows, range(2, 6)), *lines)


def look(path: Path | str, dbc: Path | str | None = None) -> LookResult:
    """Say what is in a recording, and which ``[signals]`` read it."""
    return LookResult(look_into(Path(path), None if dbc is None else Path(dbc)))
