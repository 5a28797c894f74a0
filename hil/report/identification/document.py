"""``identification.json``, schema ``hil.identification/1``: extended over time, never broken.

Coefficients are written with all their digits, so that a model read back is the same to the bit.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from estimator.identification.identify import Identification
from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.identification.modes.modes import Mode
from estimator.identification.offline.orders import OrderChoice
from estimator.identification.settings import Settings
from estimator.identification.spectral import SpectralEstimate
from estimator.identification.study import Compared, Study
from hil.provenance import Provenance
from hil.report.identification.document_study import studied
from hil.report.numbers import json_number

SCHEMA: Final = "hil.identification/1"
FILE_NAME: Final = "identification.json"


def identification_text(
    results: Sequence[Identification],
    settings: Settings,
    nominal: Mode | None,
    studies: Sequence[Study] = (),
    choice: OrderChoice | None = None,
    compared: Sequence[Compared] = (),
    made: Provenance | None = None,
) -> str:
    """Return the text of the file.

    Parameters
    ----------
    results
        Of every recording.
    settings
        They were identified with.
    nominal
        Mode that a model file expects.
    studies
        The same questioned, in the same order; none leaves the entries about it out.
    choice
        How order and delay were chosen, where they were.
    compared
        Other recursive estimators on the same data.
    """
    extras: list[dict[str, Any]] = [studied(each) for each in studies] or [{} for _ in results]
    document = {
        "schema": SCHEMA,
        "settings": {
            "na": settings.orders.na,
            "nb": settings.orders.nb,
            "nk": settings.orders.nk,
            "sample_time_s": settings.sample_time_s,
            "offline_sample_time_s": settings.offline_sample_time_s,
            "high_pass_hz": settings.high_pass_hz,
            "samples": settings.samples,
            "filter_part": settings.filter_part.value,
            "band_hz": list(settings.band_hz),
        },
        "nominal_resonance": _mode(nominal),
        "order_choice": None if choice is None else _choice(choice),
        "recordings": [_recording(result) | extra for result, extra in zip(results, extras, strict=True)],
        "compared": [_compared(each) for each in compared],
    }
    if made is not None:
        document["made"] = made.document()
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _recording(found: Identification) -> dict[str, Any]:
    estimate, batch = found.estimate, found.batch
    online = _model(found.online, found.online_resonance) | {
        "status": estimate.status.value,
        "reason": estimate.reason.message,
        "samples_used": int(found.trajectory.used.sum()),
    }
    offline = _model(batch.model, found.batch_resonance) | {
        "covariance": batch.covariance.tolist(),
        "rms": batch.rms,
        "fit_percent": batch.fit_percent,
        "one_step_fit_percent": json_number(batch.one_step_fit_percent),
        "samples_used": batch.n_samples,
    }
    return {
        "name": found.name,
        "output": found.data.kind.value,
        "online": online,
        "batch": offline,
        "filter_L": found.L.tolist(),
        "spectral": None if found.spectral is None else _spectral(found.spectral),
        "no_spectral": found.no_spectral,
    }


def _model(model: LinearModel, resonance: Mode | None) -> dict[str, Any]:
    return {
        "theta": model.theta.tolist(),
        "A": model.A.tolist(),
        "B": model.B.tolist(),
        "sample_time_s": model.sample_time_s,
        "poles": _pairs(model.poles),
        "zeros": _pairs(model.zeros),
        "resonance": _mode(resonance),
    }


def _pairs(roots: ComplexArray) -> list[list[float]]:
    return [[float(root.real), float(root.imag)] for root in roots]


def _mode(mode: Mode | None) -> dict[str, float] | None:
    return None if mode is None else {"frequency_hz": mode.frequency_hz, "damping": mode.damping}


def _spectral(estimate: SpectralEstimate) -> dict[str, Any]:
    return {
        "frequency_hz": [json_number(f) for f in estimate.frequency_hz.tolist()],
        "magnitude": [json_number(m) for m in np.abs(estimate.response).tolist()],
        "phase_rad": [json_number(p) for p in np.angle(estimate.response).tolist()],
        "magnitude_std": [json_number(s) for s in estimate.magnitude_std.tolist()],
        "coherence": [json_number(c) for c in estimate.coherence.tolist()],
        "n_averages": estimate.n_averages,
        "used_samples": estimate.used_samples,
        "bridged_samples": estimate.bridged_samples,
    }


def _choice(choice: OrderChoice) -> dict[str, Any]:
    return {
        "statement": choice.statement,
        "candidates": [
            {
                "na": each.orders.na,
                "nb": each.orders.nb,
                "nk": each.orders.nk,
                "criterion": json_number(each.criterion),
                "rms": json_number(each.rms),
                "unseen_fit_percent": json_number(each.unseen_fit_percent),
            }
            for each in choice.candidates
        ],
    }


def _compared(each: Compared) -> dict[str, Any]:
    return {
        "recording": each.recording,
        "estimator": each.estimator,
        "resonance": _mode(each.resonance),
        "fit_percent": json_number(each.fit_percent),
        "status": each.status.value,
        "reason": each.reason,
    }
