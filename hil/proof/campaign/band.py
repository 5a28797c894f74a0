"""The score of a frequency band: what was reported of a case, besides what the truth simulator says of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from hil.proof.campaign.kinds import NOTHING, Kind
from hil.proof.mismatch.band import compare, spectrum_of
from hil.proof.mismatch.rest import true_rest_rad_s
from hil.proof.truth.specimen import draw_specimen

Json = Mapping[str, Any]

OTHER_SIMULATOR = "the truth simulator no longer draws the bus that was sealed from this kind and seed"


def score_band(kind: Kind, seed: int, truth: Json, diagnosis: Json | None) -> dict[str, Any] | None:
    """Return the band's part of a case's row, JSON types only; None where nothing is hidden or no band was reported.

    The recordings are driven anew without noise: kind and seed are all it takes. Where the simulator has changed since
    the truth was sealed, ``fault`` says so and there is no score.

    Parameters
    ----------
    kind, seed
        What was planted, and what everything was drawn from.
    truth
        As it was sealed.
    diagnosis
        Content of ``diagnosis.json``; None where there is none.
    """
    reported = None if diagnosis is None else diagnosis["mismatch"].get("band_hz")
    if reported is None or kind.effect == NOTHING:
        return None
    specimen = draw_specimen(kind.effect, seed, kind.nominal_error)
    drawn = json.loads(json.dumps(specimen.truth()))
    if any(truth[name] != value for name, value in drawn.items()):
        return {"told_hz": list(reported), "fault": OTHER_SIMULATOR}
    compared = compare((reported[0], reported[1]), spectrum_of(true_rest_rad_s(specimen)))
    return {**json.loads(json.dumps(asdict(compared))), "right": compared.right}
