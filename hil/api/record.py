"""A recording in Python: read from a file or taken from a table of pandas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from estimator.signals import record as base
from hil.api.models import Model, signals_of
from hil.recording import columns
from hil.recording.channels import column_of, understood
from hil.recording.signals import read_record, to_record, under_imposed_motion
from hil.recording.table import Table
from hil.report.figures import Line, Panel, Style, input_lines, time_panels
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
        signals: Mapping[str, Any] | None = None,
        model: Model | None = None,
    ) -> Self:
        """Take the columns of a table.

        Parameters
        ----------
        frame : pandas.DataFrame
            Columns as in a file; without a column for the time its index is the time, in seconds or as moments.
        name : str
            What the recording is called in results.
        signals : mapping, optional
            As ``[signals]`` of a model file; the contract's columns without it.
        model : path or model file, optional
            Whose ``[signals]`` count, where ``signals`` is not given.

        Raises
        ------
        RecordingError
            If the columns are not those of a recording, by name.
        """
        known, on_bench = signals_of(signals, model)
        cells = {str(key): column_of(frame[key].to_numpy()) for key in frame.columns}
        time = known.time.column or columns.TIME
        if known.time.column is not None and time not in cells:
            cells[time] = column_of(frame.index.to_numpy())
        record = to_record(understood(Table(Path(name), cells)), known)
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
        measured = Line("measured", np.where(self.okay, self.output, np.nan), Style.AFTER)
        panels = (
            Panel("torque [Nm]", input_lines(self.torque_nm)),
            Panel(f"{quantity(unit)} [{unit}]", (measured,)),
        )
        return time_panels(self.time_s, panels, DRAWN)

    def __repr__(self) -> str:
        duration_s = self.sample_time_s * self.time_s.size
        inputs = f"{self.torque_nm.shape[1]} torque{'s' if self.torque_nm.shape[1] > 1 else ''}"
        return (
            f"<Record {self.name}: {duration_s:.4g} s at {self.sample_time_s:g} s, {inputs}, {self.kind.value}, "
            f"{int(self.okay.sum())} of {self.okay.size} samples count>"
        )


def read(path: Path | str, signals: Mapping[str, Any] | None = None, model: Model | None = None) -> Record:
    """Read a recording from a file of any format that ``hil`` reads."""
    known, on_bench = signals_of(signals, model)
    return Record.of(read_record(path, known, on_bench), Path(path))
