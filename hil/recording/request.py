"""What is asked of a recording: in which form it is read, and which of its channels are to be brought together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil.recording.format_hints import FormatHints


@dataclass(frozen=True, slots=True)
class Request:
    """What a reader has to know in addition to the file.

    Attributes
    ----------
    form : FormatHints
        Of a text file.
    columns : tuple of str
        Channels that are needed, by the names or addresses they have in the file; empty for those that belong together.
    time : str, optional
        The channel of the time, where it is one.
    held : tuple of str
        Those of them whose last value counts until the next; between the others' values lie straight lines.
    resample_s : float, optional
        Period to which channels of different rates are brought [s].
    dbc : Path, optional
        What the frames of a logged CAN bus mean.
    """

    form: FormatHints = field(default_factory=FormatHints)
    columns: tuple[str, ...] = ()
    time: str | None = None
    held: tuple[str, ...] = ()
    resample_s: float | None = None
    dbc: Path | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """All channels that are needed, the time included."""
        return self.columns if self.time is None else (self.time, *self.columns)

    def as_document(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return {
            "form": self.form.model_dump(),
            "columns": list(self.columns),
            "time": self.time,
            "held": list(self.held),
            "resample_s": self.resample_s,
            "dbc": None if self.dbc is None else str(self.dbc.absolute()),
        }

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> Request:
        """Return what `as_document` was made of."""
        dbc = document["dbc"]
        return cls(
            FormatHints.model_validate(document["form"]),
            tuple(document["columns"]),
            document["time"],
            tuple(document["held"]),
            document["resample_s"],
            None if dbc is None else Path(dbc),
        )
