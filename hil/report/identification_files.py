"""Identification of several recordings, and its files: identification.json and report.html."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from estimator.errors import NotExciting, made_of_each
from estimator.identification.identify import Compared, Study, identify, require_determined, study
from estimator.identification.joint import Together, joint_estimate
from estimator.identification.modes.modes import Mode
from estimator.identification.offline.validation import OrderChoice
from estimator.identification.settings import Settings
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record
from hil.figures.local_model import LocalModel
from hil.provenance import Provenance
from hil.report.identification_json import FILE_NAME, identification_text
from hil.report.identification_page import identification_page
from hil.result_folder import publish

PAGE = "report.html"

Bar = Callable[[Sequence[Any], str], Iterable[Any]]
"""Hands the items on, and shows how far it is."""


def _no_bar(items: Sequence[Any], what: str) -> Iterable[Any]:
    return items


def identify_all(records: Sequence[Record], settings: Settings, bar: Bar = _no_bar) -> list[Study]:
    """Identify from each recording, and examine it, also on the others."""
    made_of_each(records, lambda record: require_determined(record, settings), NotExciting, NotExciting)
    found = [identify(record, settings) for record in bar(records, "identifying")]
    pairs = list(zip(records, found, strict=True))
    return [
        study(record, one, settings, [other for other in found if other is not one])
        for record, one in bar(pairs, "examining")
    ]


def publish_identification(
    folder: Path,
    records: Sequence[Record],
    settings: Settings,
    studies: Sequence[Study],
    model: DrivelineModel | None,
    made: Provenance,
    choice: OrderChoice | None = None,
    compared: Sequence[Compared] = (),
) -> tuple[str, Mode | None, Together | None]:
    """Write both files or none; return the text of the first, the mode of the model file, and the joint estimate."""
    models = [
        LocalModel.with_expected(record, each.found, model) for record, each in zip(records, studies, strict=True)
    ]
    nominal = models[0].reference_mode
    together = None
    if len(studies) > 1:
        together = joint_estimate([each.name for each in studies], [each.best for each in studies])
    found = [each.found for each in studies]
    text = identification_text(found, settings, nominal, studies, choice, compared, made, together)
    page = identification_page(models, studies, choice, compared, made, together)
    publish(
        folder,
        {
            FILE_NAME: lambda path: path.write_text(text, encoding="utf-8"),
            PAGE: lambda path: path.write_text(page, encoding="utf-8"),
        },
    )
    return text, nominal, together
