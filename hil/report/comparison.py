"""One recording against its free-run simulation, in figures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.chain import replay
from estimator.physics.model import DrivelineModel
from estimator.signals.record import FloatArray, Record
from hil.report.numbers import json_number
from hil.report.wording import output_unit

SCHEMA = "hil.compare/1"


@dataclass(frozen=True, slots=True)
class Comparison:
    """A recording, its simulation, and how far they differ.

    Attributes
    ----------
    simulated : ndarray, shape (N,)
        In ``unit``.
    rms, largest : float
        Of the error over the samples that count.
    load_torque : float
        Constant load torque that was estimated [Nm; translation N].
    fit_percent : float
        100 (1 - norm of the error / norm of the output without its mean), the NRMSE fit: 100 is perfect, 0 is
        no better than a constant. NaN for an output that does not move.
    """

    record: Record
    simulated: FloatArray
    unit: str
    rms: float
    largest: float
    load_torque: float
    fit_percent: float

    @property
    def error(self) -> FloatArray:
        """Measured minus simulated, shape (N,); NaN where a sample does not count."""
        return np.where(self.record.okay, self.record.output - self.simulated, np.nan)


def compare_record(model: DrivelineModel, record: Record) -> Comparison:
    """Simulate a recording and measure the error."""
    run = replay(model, record)
    simulated = run.output
    okay = record.okay
    error = record.output[okay] - simulated[okay]
    spread = float(np.std(record.output[okay]))
    rms = float(np.sqrt(np.mean(error**2)))
    return Comparison(
        record,
        simulated,
        output_unit(record.kind, model.motion),
        rms,
        float(np.max(np.abs(error))),
        run.start.load_torque_nm,
        100.0 * (1.0 - rms / spread) if spread > 0 else float("nan"),
    )


def comparison_text(comparisons: Sequence[Comparison]) -> str:
    """Return the figures as JSON text."""
    content = {
        "schema": SCHEMA,
        "recordings": {
            each.record.name: {
                "unit": each.unit,
                "rms": json_number(each.rms),
                "largest": json_number(each.largest),
                "load_torque": json_number(each.load_torque),
                "fit_percent": json_number(each.fit_percent),
                "samples_used": int(each.record.okay.sum()),
                "samples": int(each.record.okay.size),
            }
            for each in comparisons
        },
    }
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
