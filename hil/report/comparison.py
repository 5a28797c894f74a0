"""Recordings against their free-run simulations, in figures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimator.identification.offline.blocks import block_of
from estimator.identification.offline.validation import CorrelationTest, residual_tests
from estimator.physics.model import Motion
from estimator.signals.record import FloatArray, Record
from hil.plants.plant import Plant
from hil.provenance import Provenance
from hil.report.numbers import json_number
from hil.report.wording import output_unit

SCHEMA = "hil.compare/1"


@dataclass(frozen=True, slots=True)
class Comparison:
    """A recording, its simulation by one model, and how far they differ.

    Attributes
    ----------
    model : str
        Name of the model.
    simulated : ndarray, shape (N,)
        In ``unit``.
    rms, largest : float
        Of the error over the samples that count.
    load_torque : float
        Constant load torque that was estimated [Nm; translation N]; NaN where the model has none.
    fit_percent : float
        100 (1 - norm of the error / norm of the output without its mean), the NRMSE fit: 100 is perfect, 0 is
        no better than a constant. NaN for an output that does not move.
    past_input, itself : CorrelationTest
        Of the error with the past torque, which a complete model leaves none of, and with its own past.
    """

    model: str
    motion: Motion
    record: Record
    simulated: FloatArray
    unit: str
    rms: float
    largest: float
    load_torque: float
    fit_percent: float
    past_input: CorrelationTest
    itself: CorrelationTest

    @property
    def error(self) -> FloatArray:
        """Measured minus simulated, shape (N,); NaN where a sample does not count."""
        return np.where(self.record.okay, self.record.output - self.simulated, np.nan)


def compare_record(plant: Plant, record: Record) -> Comparison:
    """Simulate a recording and measure the error."""
    run = plant.run(record)
    okay = record.okay
    error = record.output - run.output
    past_input, _, itself = residual_tests(error, record, block_of(record.sample_time_s))
    spread = float(np.std(record.output[okay]))
    rms = float(np.sqrt(np.mean(error[okay] ** 2)))
    return Comparison(
        plant.name,
        plant.motion,
        record,
        run.output,
        output_unit(record.kind, plant.motion),
        rms,
        float(np.max(np.abs(error[okay]))),
        run.start.load_torque_nm,
        100.0 * (1.0 - rms / spread) if spread > 0 else float("nan"),
        past_input,
        itself,
    )


def together(comparisons: Sequence[Comparison]) -> float:
    """Return the RMS of the error over all samples of several recordings, as ``hil diagnose`` gives it."""
    squares = sum(each.rms**2 * int(each.record.okay.sum()) for each in comparisons)
    return float(np.sqrt(squares / sum(int(each.record.okay.sum()) for each in comparisons)))


def comparison_text(comparisons: Sequence[Sequence[Comparison]], made: Provenance | None = None) -> str:
    """Return the figures as JSON text: ``recordings`` are those of the first model.

    Parameters
    ----------
    comparisons : sequence of sequence of Comparison
        Of each recording those of all models.
    """
    by_model = list(zip(*comparisons, strict=True))
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "recordings": _recordings(by_model[0]),
        "models": {of[0].model: {"rms": json_number(together(of)), "recordings": _recordings(of)} for of in by_model},
    }
    if made is not None:
        content["made"] = made.document()
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _recordings(comparisons: Sequence[Comparison]) -> dict[str, Any]:
    return {
        each.record.name: {
            "unit": each.unit,
            "rms": json_number(each.rms),
            "largest": json_number(each.largest),
            "load_torque": json_number(each.load_torque),
            "fit_percent": json_number(each.fit_percent),
            "samples_used": int(each.record.okay.sum()),
            "samples": int(each.record.okay.size),
            "residual": {
                "past_input_p_value": json_number(each.past_input.p_value),
                "autocorrelation_p_value": json_number(each.itself.p_value),
            },
        }
        for each in comparisons
    }
