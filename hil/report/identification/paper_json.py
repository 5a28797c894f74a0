"""``paper.json``: the numbers of ``hil paper`` for scripts."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Final

from estimator.identification.settings import Settings
from hil.figures.local_model import Row
from hil.figures.road import Conditions
from hil.provenance import Provenance
from hil.report.numbers import json_number

SCHEMA: Final = "hil.paper/1"


def paper_text(
    rows: Sequence[Row],
    settings: Settings,
    driven: Sequence[Conditions],
    seed: int | None,
    made: Provenance | None = None,
) -> str:
    """Return the text of the file; ``seed`` is None and ``driven`` empty where recordings were given.

    ``made`` is given with recordings alone: from one seed the same file comes at any time.
    """
    document = {
        "schema": SCHEMA,
        "seed": seed,
        "settings": {
            "na": settings.orders.na,
            "nb": settings.orders.nb,
            "nk": settings.orders.nk,
            "sample_time_s": settings.sample_time_s,
            "samples": settings.samples,
            "high_pass_hz": settings.high_pass_hz,
        },
        "experiments": [_row(row) for row in rows],
        "conditions": [asdict(each) for each in driven],
        **({} if made is None else {"made": made.document()}),
    }
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _row(row: Row) -> dict[str, Any]:
    return {key: json_number(value) if isinstance(value, float) else value for key, value in asdict(row).items()}
