"""An identification in Python."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from estimator.identification.identify import Study
from estimator.identification.modes.modes import Uncertain
from estimator.identification.settings import Settings
from hil.api.diagnosis import Recordings, records_of, sources_of
from hil.api.models import Model, as_file
from hil.api.record import Record
from hil.config.model_file import ModelFile
from hil.errors import UsageError
from hil.figures.local_model import LocalModel
from hil.provenance import Provenance, provenance
from hil.report import page as html
from hil.report.bode import response
from hil.report.identification_files import identify_all, publish_identification
from hil.report.identification_page import numbers_table
from hil.report.identification_wording import headline, verdict

if TYPE_CHECKING:
    import pandas
    import plotly.graph_objects as go


@dataclass(frozen=True, slots=True)
class IdentificationResult:
    """What was identified; ``studies`` holds of each recording all of it."""

    studies: Sequence[Study]
    records: tuple[Record, ...]  # in the order in which they were given
    settings: Settings  # of all of them
    file: ModelFile | None  # None: recordings are this program's own
    made: Provenance  # files, with their checksums, and program

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a row per recording: resonance [Hz] and damping with 95 % intervals; NaN where there is none."""
        import pandas

        found = {each.name: each.resonance for each in self.studies}
        rows = {
            name: (*_with_interval(mode.frequency_hz), *_with_interval(mode.damping))
            for name, mode in found.items()
            if mode is not None
        }
        quantities = ("frequency_hz", "damping")
        columns = [f"{name}{end}" for name in quantities for end in ("", "_low", "_high")]
        return pandas.DataFrame.from_dict(rows, orient="index", columns=columns).reindex(list(found))

    def plot(self, recording: str | None = None) -> go.Figure:
        """Draw the frequency response of a recording, by default the first, with all its models."""
        by_name = dict(zip([each.name for each in self.studies], range(len(self.studies)), strict=True))
        if recording is not None and recording not in by_name:
            raise UsageError(f"recording {recording!r}: expected one of {', '.join(by_name)}")
        at = 0 if recording is None else by_name[recording]
        from hil.api.drawn import Drawn

        return Drawn(response(self._models()[at], self.studies[at].best.fit))

    def save(self, folder: Path | str) -> Path:
        """Write identification.json and report.html, as ``hil identify --out`` does; return the folder."""
        folder = Path(folder)
        model = None if self.file is None else self.file.model
        publish_identification(folder, self.records, self.settings, self.studies, model, self.made)
        return folder

    def _models(self) -> list[LocalModel]:
        model = None if self.file is None else self.file.model
        pairs = zip(self.records, self.studies, strict=True)
        return [LocalModel.with_expected(record, each.found, model) for record, each in pairs]

    def __repr__(self) -> str:
        return f"<Identification: {headline(self.studies)}>"

    def _repr_html_(self) -> str:
        statements = [html.paragraph(verdict(each)) for each in self.studies]
        title = html.Heading(headline(self.studies))
        return html.fragment(title, *statements, *numbers_table(self._models(), self.studies))


def identify(
    recordings: Recordings, model: Model | None = None, settings: Settings | None = None
) -> IdentificationResult:
    """Identify the driveline from each recording: models, resonance, damping.

    Parameters
    ----------
    recordings : Record, path, or several
        To identify from.
    model : path or model file, optional
        How to read foreign recordings, and what to compare with.
    settings : Settings, optional
        Orders, delay and sampling periods, as ``hil identify`` has them by default.

    Raises
    ------
    ModelFileError, RecordingError
        For what can't be read.
    EstimatorError
        For recordings that excite nothing.
    """
    file = None if model is None else as_file(model)
    records = records_of(recordings, file)
    chosen = settings or Settings(samples=1024)
    made = provenance([Path(model)] if isinstance(model, Path | str) else [], sources_of(records))
    return IdentificationResult(identify_all(records, chosen), records, chosen, file, made)


def _with_interval(each: Uncertain) -> tuple[float, float, float]:
    return (each.value, *each.ci95)
