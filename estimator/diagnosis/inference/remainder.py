"""What the best hypothesis leaves beyond noise and drift: its innovations are tested for what noise has not.

Innovations are independent: of their own past, of torque, speed and angle; they have no line in their spectrum and do
not change over time; and the disturbances that made them so are within what such disturbances are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.inference.calibration import MOST_CHANGE, MOST_DEPENDENT, MOST_LINE, MOST_PREDICTABLE
from estimator.diagnosis.inference.disturbances import Size
from estimator.diagnosis.inference.likelihood import Hypothesis, residuals
from estimator.diagnosis.noise import unpredictable
from estimator.physics.motion import measured_speed
from estimator.physics.simulate import motor_angle
from estimator.signals.record import FloatArray, Record

BINS = 12
"""Bins of torque and of speed, of equal count."""

CHANGE_S = 1.0
EDGE = 0.02
"""Distance from the bound of a disturbance's logarithm within which it has reached it."""

DISTURBANCES = {
    Size.TORQUE: "the torque reading's noise",
    Size.DRIFT: "the torque reading's drift",
    Size.WALK: "the load's slow change",
}


@dataclass(frozen=True, slots=True)
class Test:
    """One property that noise has: how far an error is from it, and the most that noise shows.

    ``is_share`` where the value is the share of the error's variance that is no noise: information about the laws, in
    the units of a score over the number of samples, that no hypothesis has found. Differences of scores count by it.
    """

    name: str
    value: float
    most: float
    is_share: bool = False

    @property
    def failed(self) -> bool:
        """Whether it is more than noise."""
        return self.value > self.most


def tests(best: Hypothesis) -> tuple[Test, ...]:
    """Return the tests of what a hypothesis leaves."""
    problem = best.plain.problem
    errors = residuals(best, best.white.residual)
    whole = np.concatenate(errors)
    power = float(whole @ whole) / whole.size
    return (
        Test("foretold by its own past", 1.0 - unpredictable(errors) ** 2 / power, MOST_PREDICTABLE, True),
        Test("dependent on torque, speed or angle", _dependent(best, whole), MOST_DEPENDENT, True),
        Test("a line in its spectrum", max(_line(each) for each in errors), MOST_LINE),
        Test("changing over time", _change(errors, problem.records) / power, MOST_CHANGE),
        *(Test(name, float(best.sizes[size] > best.limits.high[size] - EDGE), 0.5) for size, name in _bounded(best)),
    )


def _bounded(best: Hypothesis) -> list[tuple[Size, str]]:
    return [(size, name) for size, name in DISTURBANCES.items() if best.limits.low[size] < best.limits.high[size]]


def _dependent(best: Hypothesis, whole: FloatArray) -> float:
    """Return the share of the innovations' variance that is a function of torque, speed or angle, bias removed."""
    problem = best.plain.problem
    torque, speed, angle = (
        np.concatenate([signal(record)[use] for record, use in zip(problem.records, problem.use, strict=True)])
        for signal in (_driven_by, lambda r: np.nan_to_num(measured_speed(r)), motor_angle)
    )
    columns = [np.ones(whole.size)]
    for signal in (torque, speed):
        edges = np.unique(np.quantile(signal, np.linspace(0.0, 1.0, BINS + 1)[1:-1]))
        columns += [(np.digitize(signal, edges) == i).astype(float) for i in range(edges.size)]
    columns += [wave(times * angle) for times in (1.0, 2.0) for wave in (np.sin, np.cos)]
    basis = np.linalg.qr(np.column_stack(columns))[0]
    explained = float(np.sum((basis.T @ whole) ** 2)) / float(whole @ whole)
    return explained - len(columns) / whole.size


def _driven_by(record: Record) -> FloatArray:
    """Return what drives a line: its torque; of a joint, whose torque is what is read, the imposed motion."""
    return record.total_torque_nm if record.imposed is None else record.imposed


def _line(error: FloatArray) -> float:
    """Return the largest power at one frequency over the mean power."""
    power = np.abs(np.fft.rfft(error))[1:] ** 2
    return float(power.max() / power.mean())


def _change(errors: Sequence[FloatArray], records: Sequence[Record]) -> float:
    """Return the largest mean square over a second."""
    found = 0.0
    for error, record in zip(errors, records, strict=True):
        length = max(1, min(round(CHANGE_S / record.sample_time_s), error.size))
        length = max(length, min(50, error.size))
        squares = (error[: error.size // length * length] ** 2).reshape(-1, length).mean(axis=1)
        found = max(found, float(squares.max()))
    return found
