"""A recording in Python: looked into, read from a file, or taken from a table of pandas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from estimator.signals import record as base
from hil.api.models import Model, Signals, signals_as_table, signals_of
from hil.recording import columns
from hil.recording.channels import column_of, understood
from hil.recording.look import CHANNEL_HEADINGS, Look, channel_rows, look as look_into
from hil.recording.signals import read_record, to_record, under_imposed_motion
from hil.recording.survey import survey_of
from hil.recording.table import Table
from hil.report import page as html
from hil.report.figures import Curve, Panel, Style, input_lines, time_panels
from hil.report.wording import quantity

if TYPE_CHECKING:
    import pandas
    import plotly.graph_objects as go

UNITS = {base.OutputKind.SPEED: "rad/s", base.OutputKind.POSITION: "rad", base.OutputKind.FORCE: "Nm"}
DRAWN = 3000
"""Parts of a line of which the lowest and the highest sample are drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class Record(base.Record):
    """A recording: torques in, a measured output, and which samples count.

    ``source`` is the file it was read from. All else as ``estimator.signals.record.Record`` has it.
    """

    source: Path | None = None

    @classmethod
    def of(cls, record: base.Record, source: Path | None = None) -> Self:
        """Take over a recording of the estimator."""
        return cls(**{each.name: getattr(record, each.name) for each in fields(base.Record)}, source=source)

    @classmethod
    def from_pandas(
        cls,
        frame: pandas.DataFrame,
        name: str = "frame",
        signals: Signals | None = None,
        model: Model | None = None,
        *,
        torque: str | Sequence[str] | None = None,
        speed: str | None = None,
        position: str | None = None,
        time: str | None = None,
    ) -> Self:
        """Take the columns of a table.

        Parameters
        ----------
        frame : pandas.DataFrame
            Columns as in a file; without a column for the time its index is the time, in seconds or as moments, or a
            column that rises evenly.
        name : str
            What the recording is called in results.
        signals : mapping or str, optional
            As ``[signals]`` of a model file, or its lines as `look` gives them; the contract's columns without it.
        model : path or model file, optional
            Whose ``[signals]`` count, where ``signals`` is not given.
        torque, speed, position, time : str, or several for ``torque``, optional
            Columns by name, in place of those of ``signals``.

        Raises
        ------
        RecordingError
            If the columns are not those of a recording, by name.
        """
        named = {"speed": speed, "position": position, "time": time}
        given: dict[str, Any] = {role: {"column": column} for role, column in named.items() if column is not None}
        if torque is not None:
            given["torque"] = [{"column": each} for each in ([torque] if isinstance(torque, str) else torque)]
        known, on_bench = signals_of({**signals_as_table(signals or {}), **given} if given else signals, model)
        cells = {str(key): column_of(frame[key].to_numpy()) for key in frame.columns}
        counted = known.time.column or columns.TIME
        is_counted = type(frame.index).__name__ == "RangeIndex"  # of rows, which are no time
        if known.time.column is not None and counted not in cells and not is_counted:
            cells[counted] = column_of(frame.index.to_numpy())
        table = understood(Table(Path(name), cells, is_frame=True))
        if time is None and counted not in cells:
            table = replace(table, master=survey_of([table]).groups[0].time)
        record = to_record(table, known)
        return cls.of(under_imposed_motion(record) if on_bench else record)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return torques, output and ``okay`` over time; a sample that does not count is NaN."""
        import pandas

        torques = {f"torque_{i + 1}_nm": self.torque_nm[:, i] for i in range(self.torque_nm.shape[1])}
        measured = np.where(self.okay, self.output, np.nan)
        return pandas.DataFrame(
            {**torques, self.kind.value: measured, "okay": self.okay}, index=pandas.Index(self.time_s, name="time_s")
        )

    def plot(self) -> go.Figure:
        """Draw torques and output over time."""
        unit = UNITS[self.kind]
        measured = Curve("measured", np.where(self.okay, self.output, np.nan), Style.AFTER)
        panels = (
            Panel("torque [Nm]", input_lines(self.torque_nm)),
            Panel(f"{quantity(unit)} [{unit}]", (measured,)),
        )
        from hil.api.drawn import Drawn

        return Drawn(time_panels(self.time_s, panels, DRAWN))

    def __repr__(self) -> str:
        duration_s = self.sample_time_s * self.time_s.size
        inputs = f"{self.torque_nm.shape[1]} torque{'s' if self.torque_nm.shape[1] > 1 else ''}"
        return (
            f"<Record {self.name}: {duration_s:.4g} s at {self.sample_time_s:g} s, {inputs}, {self.kind.value}, "
            f"{int(self.okay.sum())} of {self.okay.size} samples count>"
        )


def read(path: Path | str, signals: Signals | None = None, model: Model | None = None) -> Record:
    """Read a recording from a file of any format that ``hil`` reads; ``signals`` may be ``look(path).signals``."""
    known, on_bench = signals_of(signals, model)
    return Record.of(read_record(path, known, on_bench), Path(path))


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
