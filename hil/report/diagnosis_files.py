"""The files of a diagnosis: diagnosis.json, augmented.toml and report.html."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from estimator.diagnosis.result import Diagnosis
from estimator.signals.record import Record
from hil.config.model_file import ModelFile, write_model
from hil.plants.prepared import prepared_by
from hil.provenance import Provenance
from hil.report.diagnosis_html import diagnosis_page
from hil.report.diagnosis_json import diagnosis_text
from hil.result_folder import publish

NO_MORE: Mapping[str, Callable[[Path], object]] = MappingProxyType({})


def publish_diagnosis(
    folder: Path,
    diagnosis: Diagnosis,
    file: ModelFile,
    records: Sequence[Record],
    paths: Sequence[Path | None],
    made: Provenance,
    more: Mapping[str, Callable[[Path], object]] = NO_MORE,
) -> None:
    """Write the files of a diagnosis, all or none; of a plant that another program simulates no augmented model."""
    text, prepared = diagnosis_text(diagnosis, made), prepared_by(diagnosis, records, paths)
    augmented, page = diagnosis.augmented, diagnosis_page(diagnosis, made, prepared.one_in)
    files: dict[str, Callable[[Path], object]] = {
        "diagnosis.json": lambda path: path.write_text(text, encoding="utf-8"),
        "augmented.toml": lambda path: write_model(path, augmented, file.signals, file.laws, prepared),
        "report.html": lambda path: path.write_text(page, encoding="utf-8"),
        **more,
    }
    if file.is_foreign:
        del files["augmented.toml"]
    publish(folder, files)
