"""What a hypothesis must pass: values that a machine can have, and a remainder that noise would leave."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.disturbances import Size
from estimator.diagnosis.inference.hypotheses import GRADE, Effects, Hypothesis
from estimator.diagnosis.line.line import line_values
from estimator.diagnosis.noise import residuals_by_record, unpredictable
from estimator.diagnosis.thresholds import Checks, Noise
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element, Span
from estimator.physics.fit import FitResult
from estimator.physics.inputs import shaft_torque
from estimator.physics.model import DrivelineModel
from estimator.physics.motion import longest_s, measured_speed, motor_angle
from estimator.physics.steps import has_edge
from estimator.physics.unknowns import Shared
from estimator.signals.record import FloatArray, Record

COLUMNS = {"most_predictable": Noise.PREDICTOR_ORDER, "most_dependent": 2 * Checks.BINS + 3}
"""How many signals a share of the innovations is sought in: past samples; bins, waves in the angle, and a mean."""

DISTURBANCES = {
    Size.TORQUE: "is more than the noise of a torque reading",
    Size.DRIFT: "is more than the drift of a torque reading",
    Size.WALK: "is more than the slow change of a load",
}


def is_possible(hypothesis: Hypothesis, records: Sequence[Record]) -> bool:
    """Tell whether a machine can be so: its input is on, it is not stuck, no load walks so far, events take place."""
    values, result = _values_of(hypothesis), hypothesis.result
    if GRADE in hypothesis.effects and _walk(hypothesis, records) > _most_torque(records):
        return False
    edges = all(has_edge(name, result) for name in values if EFFECTS[name].event)
    return edges and _is_driven(result, records) and not _is_stuck(values, records)


def is_plausible(hypothesis: Hypothesis, model: DrivelineModel, records: Sequence[Record]) -> bool:
    """Tell whether a machine can be so, and the values of every effect are a case of it."""
    values = _values_of(hypothesis)
    if any(EFFECTS[name].implausible(model, records, values[name]) for name in values):
        return False
    return is_possible(hypothesis, records) and _is_described(hypothesis, model)


def _values_of(hypothesis: Hypothesis) -> dict[str, Mapping[str, float]]:
    return {name: hypothesis.result.values_of(name) for name in hypothesis.effects - {GRADE}}


def widened(hypothesis: Hypothesis, model: DrivelineModel) -> FitResult | None:
    """Return a fit whose nominal parameters may leave their tolerances where its effects change them; None as it is."""
    result = hypothesis.result
    wide = _spans(hypothesis, model)
    shared = tuple(
        replace(each, low=each.low / Checks.LOOSE, high=each.high * Checks.LOOSE)
        if pinned and not each.effect and each.name in wide and _is_tight(each, model)
        else each
        for each, pinned in zip(result.problem.shared, result.pinned, strict=False)
    )
    if shared == result.problem.shared:
        return None
    return replace(result, problem=replace(result.problem, shared=shared), converged=False)


def may_be_loose(shared: Shared, effects: Effects, model: DrivelineModel) -> bool:
    """Tell whether one of some effects changes a nominal parameter, so that it may leave its tolerance."""
    line = model.values()
    values = {name: dict.fromkeys((p.name for p in EFFECTS[name].parameters), 0.0) for name in effects - {GRADE}}
    return any(shared.name in EFFECTS[name].described(model, mine, line) for name, mine in values.items())


def _is_tight(shared: Shared, model: DrivelineModel) -> bool:
    return shared.low < shared.high <= 1.0 + model.parameters[shared.name].tolerance + Checks.ROUNDING


def _spans(hypothesis: Hypothesis, model: DrivelineModel) -> dict[str, list[Span]]:
    """Return where data sheets' values of nominal parameters may lie that the effects change, by name."""
    result, found = hypothesis.result, dict[str, list[Span]]()
    line = line_values(result)
    for name in hypothesis.effects - {GRADE}:
        for parameter, spans in EFFECTS[name].described(model, result.values_of(name), line).items():
            found.setdefault(parameter, []).extend(spans)
    return found


def _is_described(hypothesis: Hypothesis, model: DrivelineModel) -> bool:
    """Tell whether every nominal value is, within its tolerance, one that the line had at some moment."""
    line = line_values(hypothesis.result)
    for name, spans in _spans(hypothesis, model).items():
        given = model.parameters[name]
        low, high = (given.value * (1.0 + sign * (given.tolerance + Checks.ROUNDING)) for sign in (-1.0, 1.0))
        if not any(first <= high and low <= last for first, last in [*spans, (line[name], line[name])]):
            return False
    return True


def _is_driven(result: FitResult, records: Sequence[Record]) -> bool:
    for i, record in enumerate(records):
        through = shaft_torque(record.torque_nm, record.time_s - record.time_s[0], result.p_of(i))
        for passed, read in zip(
            np.array_split(through, Checks.PARTS), np.array_split(record.total_torque_nm, Checks.PARTS), strict=True
        ):
            if float(passed @ passed) < Checks.LEAST_THROUGH**2 * float(read @ read):
                return False
    return True


def _walk(hypothesis: Hypothesis, records: Sequence[Record]) -> float:
    """Return how far a load walks in the longest recording [Nm]."""
    return float(np.exp(hypothesis.sizes[Size.WALK])) * math.sqrt(longest_s(records))


def _most_torque(records: Sequence[Record]) -> float:
    return max(float(np.abs(record.total_torque_nm).max()) for record in records)


def _is_stuck(values: Mapping[str, Mapping[str, float]], records: Sequence[Record]) -> bool:
    """Tell whether a torque against the motion is above all torque that was applied; where it swings it need not be."""
    most = _most_torque(records)
    return any(
        values[name].get(parameter.name, 0.0) > most
        for name in values
        if EFFECTS[name].element in (Element.MOTOR, Element.LOAD) and not EFFECTS[name].swinging
        for parameter in EFFECTS[name].parameters
        if parameter.dimension == "torque" and parameter.null == 0.0  # that of a limit is beyond all torque
    )


@dataclass(frozen=True, slots=True)
class Test:
    """One property that noise has: how far an error is from it, and the most that noise shows."""

    name: str  # what an error that fails it does, in words
    value: float  # of the error
    most: float  # above it the error is more than noise
    key: str = ""  # of `thresholds.toml`; "" for a size of the noise model at its bound

    @property
    def failed(self) -> bool:
        """Whether it is more than noise."""
        return self.value > self.most


def tests(best: Hypothesis) -> tuple[Test, ...]:
    """Test what a hypothesis leaves for all that noise may not do; each says how far it is from that."""
    problem = best.result.problem
    errors = residuals_by_record(best.white)
    whole = np.concatenate(errors)
    power = float(whole @ whole) / whole.size
    limited = (
        ("most_predictable", "is correlated over time", 1.0 - unpredictable(errors) ** 2 / power),
        ("most_dependent", "depends on torque, speed or angle", _dependent(best, whole)),
        ("most_line", "has a line in its spectrum", max(_line(each) for each in errors)),
        ("most_change", "changes in size over time", _change(errors, problem.records, power)),
    )
    bounded = (Test(name, float(_is_at_bound(best, size)), 0.5) for size, name in _bounded(best))
    return (
        *(Test(name, value, Checks.TEST_LIMITS[key] + chance(key, whole.size), key) for key, name, value in limited),
        *bounded,
    )


def tests_in_words(failed: Sequence[Test]) -> str:
    """Say what an error does that noise does not, as the end of a sentence that begins with "it"."""
    names = [test.name for test in failed]
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def chance(key: str, samples: int) -> float:
    """Return how large a share of so many samples' variance a test finds in noise by chance; 0 where it is no share."""
    return Checks.CHANCE * math.sqrt(2.0 * COLUMNS[key]) / samples if key in COLUMNS else 0.0


def _bounded(best: Hypothesis) -> list[tuple[Size, str]]:
    return [(size, name) for size, name in DISTURBANCES.items() if best.limits.low[size] < best.limits.high[size]]


def _is_at_bound(best: Hypothesis, size: Size) -> bool:
    return bool(best.sizes[size] > best.limits.high[size] - Checks.EDGE)


def _dependent(best: Hypothesis, whole: FloatArray) -> float:
    """Return the share of the innovations' variance that is a function of torque, speed or angle, bias removed."""
    problem = best.result.problem
    torque, speed, angle = (
        np.concatenate([signal(record)[use] for record, use in zip(problem.records, problem.use, strict=True)])
        for signal in (_driven_by, lambda r: np.nan_to_num(measured_speed(r)), motor_angle)
    )
    columns = [np.ones(whole.size)]
    for signal in (torque, speed):
        edges = np.unique(np.quantile(signal, np.linspace(0.0, 1.0, Checks.BINS + 1)[1:-1]))
        columns += [(np.digitize(signal, edges) == i).astype(float) for i in range(edges.size)]
    columns += [wave(times * angle) for times in (1.0, 2.0) for wave in (np.sin, np.cos)]
    basis = np.linalg.qr(np.column_stack(columns))[0]
    explained = float(np.sum((basis.T @ whole) ** 2)) / float(whole @ whole)
    return explained - len(columns) / whole.size


def _driven_by(record: Record) -> FloatArray:
    """Return what drives a line: its torque; of a joint, whose torque is what is read, the imposed motion."""
    return record.total_torque_nm if record.imposed is None else record.imposed


def _line(error: FloatArray) -> float:
    """Return the largest power at one frequency over the mean power; of what repeats often enough to be a line."""
    power = np.abs(np.fft.rfft(error))[1:] ** 2
    return float(power[Checks.FEWEST_PERIODS - 1 :].max() / power.mean())


def _change(errors: Sequence[FloatArray], records: Sequence[Record], power: float) -> float:
    """Return the largest mean square over a second, or 50 samples, less the mean of all, in standard deviations."""
    found = 0.0
    for error, record in zip(errors, records, strict=True):
        length = max(1, min(max(round(Checks.CHANGE_S / record.sample_time_s), Checks.MIN_SAMPLES), error.size))
        squares = (error[: error.size // length * length] ** 2).reshape(-1, length).mean(axis=1)
        found = max(found, (float(squares.max()) / power - 1.0) * math.sqrt(0.5 * length))
    return found
