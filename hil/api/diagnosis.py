"""A diagnosis in Python."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from estimator.diagnosis.diagnose import diagnose as diagnose_records
from estimator.diagnosis.result import Diagnosis, Trace
from estimator.errors import made_of_each
from hil.api.models import Model, as_file
from hil.api.record import DRAWN, Record, read
from hil.config.model_file import ModelFile
from hil.errors import InputError, RecordingError, UsageError
from hil.plants.scales import with_lines, with_the_line_to_write
from hil.provenance import Provenance, provenance
from hil.report import page as html
from hil.report.diagnosis_files import publish_diagnosis
from hil.report.diagnosis_html import course_panels, doubts
from hil.report.figures import time_panels
from hil.report.numbers import shown, shown_interval
from hil.report.wording import badge, headline

if TYPE_CHECKING:
    import pandas
    import plotly.graph_objects as go

Recordings = Record | Path | str | Sequence[Record | Path | str]


@dataclass(frozen=True, slots=True)
class DiagnosisResult:
    """What a diagnosis found: ``diagnosis`` holds all of it, as ``diagnosis.json`` does."""

    diagnosis: Diagnosis
    file: ModelFile  # the model that was questioned
    records: tuple[Record, ...]  # in the order in which they were given
    made: Provenance  # files, with their checksums, and program

    @property
    def verdict(self) -> str:
        """One of ``explained``, ``partly_explained``, ``unexplained``, ``no_mismatch``."""
        return self.diagnosis.verdict.value

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects found."""
        return tuple(effect.name for effect in self.diagnosis.effects)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a row per parameter of each effect and of the line: value, 95 % interval, unit."""
        import pandas

        rows = [
            (effect.name, name, each.value, *each.ci95, each.unit)
            for effect in self.diagnosis.effects
            for name, each in effect.parameters.items()
        ]
        rows += [("", name, each.value, *each.ci95, each.unit) for name, each in self.diagnosis.parameters.items()]
        names = ["effect", "parameter", "value", "low", "high", "unit"]
        return pandas.DataFrame(rows, columns=names).set_index(["effect", "parameter"])

    def plot(self, recording: str | None = None) -> go.Figure:
        """Draw measured and simulated output of a recording, by default the first, and their errors."""
        trace = self._trace(recording)
        from hil.api.drawn import Drawn

        return Drawn(time_panels(trace.time_s, course_panels(self.diagnosis, trace), DRAWN))

    def _trace(self, recording: str | None) -> Trace:
        traces = self.diagnosis.traces
        found = next((trace for trace in traces if recording in (None, trace.name)), None)
        if found is None:
            known = ", ".join(trace.name for trace in traces)
            raise UsageError(f"recording {recording!r}: expected one of {known}")
        return found

    def save(self, folder: Path | str) -> Path:
        """Write diagnosis.json, augmented.toml and report.html, as ``hil diagnose --out`` does; return the folder."""
        folder = Path(folder)
        sources = [record.source for record in self.records]
        publish_diagnosis(folder, self.diagnosis, self.file, self.records, sources, self.made)
        return folder

    def __repr__(self) -> str:
        fit = self.diagnosis.fit
        return f"<{headline(self.diagnosis)}; error {shown(fit.retuned)} to {shown(fit.augmented, fit.unit)}>"

    def _repr_html_(self) -> str:
        rows = [
            (effect.name, name, shown(each.value, each.unit), shown_interval(each.ci95))
            for effect in self.diagnosis.effects
            for name, each in effect.parameters.items()
        ]
        found = html.table(("effect", "parameter", "value", "95 % interval"), rows, numbers=(2, 3)) if rows else None
        title = html.Heading(f"{badge(self.diagnosis)}: {headline(self.diagnosis)}")
        return html.fragment(title, *doubts(self.diagnosis), html.paragraph(self.diagnosis.statement), found)


def diagnose(
    recordings: Recordings, model: Model, holdout: Recordings = (), budget_s: float | None = None
) -> DiagnosisResult:
    """Say where simulation and recordings differ, and which physics the model lacks.

    Parameters
    ----------
    recordings : Record, path, or several
        To explain.
    model : path or model file
        The nominal model.
    holdout : the same
        Kept back to judge the explanation on.
    budget_s : float, optional
        Time after which it is ended, undecided [s]; without it there is no limit.

    Raises
    ------
    ModelFileError, RecordingError
        For what can't be read.
    EstimatorError
        For recordings that do not belong together, or are implausible.
    """
    file = as_file(model)
    training, kept_back = records_of(recordings, file), records_of(holdout, file)
    records = (*training, *kept_back)
    with with_the_line_to_write(sources_of(records), file.signals):
        found = diagnose_records(training, file.model, kept_back, budget_s=budget_s)
        found = with_lines(found, sources_of(records), file.signals)
    made = provenance([Path(model)] if isinstance(model, Path | str) else [], sources_of(records))
    return DiagnosisResult(found, file, records, made)


def records_of(given: Recordings, file: ModelFile | None) -> tuple[Record, ...]:
    """Return recordings, read where paths are given."""
    several = [given] if isinstance(given, Record | Path | str) else given
    return tuple(
        made_of_each(
            several,
            lambda each: each if isinstance(each, Record) else read(each, model=file),
            RecordingError,
            InputError,
        )
    )


def sources_of(records: Sequence[Record]) -> list[Path]:
    """Return the files that recordings were read from, of those that were."""
    return [record.source for record in records if record.source is not None]
