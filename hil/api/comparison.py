"""Models against recordings in Python."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from estimator.diagnosis.preconditions.channels import with_usable_channels
from hil.api.diagnosis import Recordings, records_of, sources_of
from hil.api.models import Model, as_file
from hil.api.record import DRAWN
from hil.plants import ModelPlant
from hil.plants.prepared import known_events, prepare_again
from hil.provenance import Provenance, provenance
from hil.report import page as html
from hil.report.comparison import Comparison, compare_record, comparison_text, together
from hil.report.comparison_html import comparison_page, comparison_panels
from hil.report.figures import time_panels
from hil.report.numbers import shown
from hil.result_folder import publish

if TYPE_CHECKING:
    import pandas
    import plotly.graph_objects as go


@dataclass(frozen=True, slots=True)
class ComparisonResult:
    """How far models are off; ``comparisons`` holds of each recording those of all models."""

    comparisons: Sequence[Sequence[Comparison]]
    made: Provenance  # files, with their checksums, and program

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a row per recording, model and output: errors, fit, load torque, p-value."""
        import pandas

        rows = [
            (each.record.name, each.model, each.rms, each.largest, each.fit_percent, each.load_torque,
             each.past_input.p_value)
            for of_recording in self.comparisons
            for of_model in of_recording
            for each in of_model.outputs
        ]  # fmt: skip
        names = ["recording", "model", "rms", "largest", "fit_percent", "load_torque", "past_input_p_value"]
        return pandas.DataFrame(rows, columns=names).set_index(["recording", "model"])

    def plot(self, recording: int = 0) -> go.Figure:
        """Draw measured and simulated output of a recording, by its place, and the errors."""
        of_recording = self.comparisons[recording]
        from hil.api.drawn import Drawn

        return Drawn(time_panels(of_recording[0].record.time_s, comparison_panels(of_recording), DRAWN))

    def save(self, folder: Path | str) -> Path:
        """Write compare.json and compare.html, as ``hil compare --out`` does; return the folder."""
        folder = Path(folder)
        text, page = comparison_text(self.comparisons, self.made), comparison_page(self.comparisons, self.made)
        publish(
            folder,
            {
                "compare.json": lambda path: path.write_text(text, encoding="utf-8"),
                "compare.html": lambda path: path.write_text(page, encoding="utf-8"),
            },
        )
        return folder

    def __repr__(self) -> str:
        by_model = zip(*self.comparisons, strict=True)
        errors = ", ".join(f"{of[0].model} off by {shown(together(of), of[0].unit)}" for of in by_model)
        return f"<Comparison with {len(self.comparisons)} recordings: {errors}>"

    def _repr_html_(self) -> str:
        rows = [
            (each.record.name, each.model, shown(each.rms, each.unit), shown(each.fit_percent, "%"))
            for of_recording in self.comparisons
            for of_model in of_recording
            for each in of_model.outputs
        ]
        table = html.table(("recording", "model", "RMS error", "NRMSE fit"), rows, numbers=(2, 3))
        return html.fragment(html.Heading(repr(self)[1:-1]), table)


def compare(models: Model | Sequence[Model], recordings: Recordings) -> ComparisonResult:
    """Simulate recordings with models, nothing fed back, and measure the errors."""
    given = list(models) if isinstance(models, Sequence) and not isinstance(models, str) else [models]
    files = [as_file(each) for each in given]
    records = records_of(recordings, files[0])
    prepared = next((file.prepared for file in files if file.prepared is not None), None)
    ready, _ = with_usable_channels(prepare_again(records, prepared, lambda _line: None))
    names = [Path(each).name if isinstance(each, Path | str) else f"model {i}" for i, each in enumerate(given, start=1)]
    sources = sources_of(records)
    plants = [
        ModelPlant(name, file.model, known_events(file.prepared, sources))
        for name, file in zip(names, files, strict=True)
    ]
    made = provenance([Path(each) for each in given if isinstance(each, Path | str)], sources)
    return ComparisonResult([[compare_record(plant, record) for plant in plants] for record in ready], made)
