"""What the report draws: simulations of every recording, and where and how model and recordings differ."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from estimator.diagnosis.covariance import Z95
from estimator.diagnosis.inference.figures import FreeRuns, foreign_outputs
from estimator.diagnosis.inference.hypotheses import NOTHING, all_good_samples
from estimator.diagnosis.line.equivalent import (
    ACTS_AT,
    DRIVES,
    Explanation,
    explain,
    explain_all,
    smoothed,
)
from estimator.diagnosis.line.line import Motion, motion_of
from estimator.diagnosis.result import Course, Discrepancy, Equivalent, LawPicture, Trace
from estimator.diagnosis.thresholds import Noise, Places
from estimator.diagnosis.where.locate import error_spectrum, responses
from estimator.physics import model
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, fit
from estimator.physics.layout import slot
from estimator.physics.model import Motion as Kind, unit
from estimator.physics.problem import make_problem, outputs_at
from estimator.signals.record import BoolArray, FloatArray, Record


@dataclass(frozen=True, slots=True)
class Axis:
    """A signal that a law may be drawn over: its name, the dimension of its unit, and its values."""

    name: str  # in words, for a label
    dimension: str  # key of the units
    values: Callable[[Motion, FitResult], FloatArray]  # by motion and fit, (N,)
    without: Callable[[Motion, FitResult], FloatArray] | None = None  # the torque there without the law, drawn with it


def _twist_torque(motion: Motion, result: FitResult) -> FloatArray:
    return result.p[slot("", "k")] * motion.twist


TORQUE = Axis("torque", "torque", lambda m, _: m.torque)
MOTOR_SPEED = Axis("motor speed", "speed", lambda m, _: m.speed)
LOAD_SPEED = Axis("load speed", "speed", lambda m, _: m.load_speed)
TWIST_TORQUE = Axis("shaft torque k·twist", "torque", _twist_torque)
TWIST_RATE = Axis("twist rate", "speed", lambda m, _: m.speed - m.load_speed)
ACCELERATION = Axis("acceleration", "speed/s", lambda m, _: np.gradient(m.speed, m.time_s))
ANGLE = Axis("motor angle in its turn", "rad", lambda m, _: np.mod(m.angle, 2.0 * np.pi))
TIME = Axis("time", "s", lambda m, _: m.time_s)

TWIST = Axis("twist of the shaft", "angle", lambda m, _: m.twist, _twist_torque)
READ_TORQUE = Axis("torque as read", "torque", lambda m, _: m.torque, lambda m, _: m.torque)

OWN_AXES: Mapping[str, Axis] = {
    **dict.fromkeys(("backlash", "stiffness_nonlinearity", "shaft_hysteresis"), TWIST),
    **dict.fromkeys(("torque_saturation", "torque_nonlinearity"), READ_TORQUE),
    **dict.fromkeys(
        ("coulomb_friction_motor", "stribeck_friction", "quadratic_friction", "asymmetric_friction", "eddy_drag"),
        MOTOR_SPEED,
    ),
    **dict.fromkeys(("coulomb_friction_load", "aerodynamic_drag"), LOAD_SPEED),
}
"""What a law is drawn over in every book: the whole torque of a shaft over its twist, what acts over what is read, and
friction over the speed. All others are drawn over the signal that they are most nearly a function of."""

AXES: Mapping[Element, tuple[Axis, ...]] = {
    Element.TORQUE_PATH: (TORQUE, MOTOR_SPEED, ANGLE, TIME),
    Element.MOTOR: (MOTOR_SPEED, ACCELERATION, TORQUE, ANGLE, TIME),
    Element.SHAFT: (TWIST_TORQUE, TWIST_RATE, MOTOR_SPEED, ANGLE, TIME),
    Element.LOAD: (LOAD_SPEED, TWIST_TORQUE, TIME),
    Element.SPEED_SENSOR: (MOTOR_SPEED, ACCELERATION, ANGLE, TORQUE, TIME),
    Element.ACQUISITION: (ACCELERATION, TIME),
}


def signal_unit(dimension: str, kind: Kind) -> str:
    """Return the unit of a signal's dimension, for rotation or translation."""
    return f"{unit('speed', kind)}/s" if dimension == "speed/s" else unit(dimension, kind)


def input_unit(place: Element, result: FitResult, kind: Kind) -> str:
    """Return the unit of an unknown input at a place; at the sensor that of the output."""
    if place is not Element.SPEED_SENSOR:
        return unit("torque", kind)
    names = {"speed": "speed", "position": "angle", "force": "torque"}
    return unit(names[result.problem.records[0].kind.value], kind)


@dataclass(frozen=True, slots=True)
class Binned:
    """Data and a law over the bins that the signal passes often enough, and how much of the law they tell."""

    arrays: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]  # (K,)
    explained: float  # share of the law's power that is a function of the signal


def binned_by_pass(
    x: Sequence[FloatArray], data: Sequence[FloatArray], law: Sequence[FloatArray], okay: Sequence[BoolArray]
) -> Binned | None:
    """Average data and law over bins of a signal, pass by pass."""
    every = np.concatenate([each[good] for each, good in zip(x, okay, strict=True)])
    low, high = np.percentile(every, [0.5, 99.5])
    if not high > low:
        return None
    edges = _edges(every, float(low), float(high))
    passes = [
        _passes(np.where(good, np.clip(np.digitize(each, edges) - 1, -1, Places.BINS), -1), (each, value, curve))
        for each, value, curve, good in zip(x, data, law, okay, strict=True)
    ]
    where = np.concatenate([bins for bins, _ in passes])
    means = np.concatenate([values for _, values in passes])
    rows = [means[where == each] for each in range(Places.BINS)]
    rows = [row for row in rows if row.shape[0] >= Places.FEWEST_PASSES]
    if len(rows) < Places.FEWEST_BINS:
        return None
    centres, values, curves = (np.array([np.average(r[:, i], weights=r[:, 3]) for r in rows]) for i in range(3))
    spread = np.array([_half_width(r[:, 1]) for r in rows])
    whole = np.concatenate([each[good] for each, good in zip(law, okay, strict=True)])
    left = whole - np.interp(every, centres, curves)
    explained = 1.0 - float(left @ left) / max(float(np.sum((whole - whole.mean()) ** 2)), np.finfo(float).tiny)
    return Binned((centres, values, values - spread, values + spread, curves), explained)


def _edges(values: FloatArray, low: float, high: float) -> FloatArray:
    """Return bin edges, half as bins of one width would have them and half as bins of one count would."""
    grid = np.linspace(low, high, 20 * Places.BINS + 1)
    counted = np.searchsorted(np.sort(values), grid) / values.size
    share = 0.5 * (grid - low) / (high - low) + 0.5 * (counted - counted[0]) / (counted[-1] - counted[0])
    return np.interp(np.linspace(0.0, 1.0, Places.BINS + 1), share, grid)


def _half_width(values: FloatArray) -> float:
    """Return half the 95 % interval of a mean of passes."""
    count = values.size
    return float(stats.t.isf(0.025, count - 1) * np.std(values, ddof=1) / np.sqrt(count))


def _passes(bins: FloatArray, signals: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the bin of each pass and the signals' means over it with its length, shapes (P,) and (P, 4)."""
    start = np.flatnonzero(np.diff(bins, prepend=bins[0] - 1))
    length = np.diff(np.append(start, bins.size)).astype(float)
    sums = [np.add.reduceat(each, start) / length for each in signals]
    return bins[start], np.stack([*sums, length], axis=1)


def picture(
    name: str,
    element: Element,
    without: FitResult,
    outputs: Sequence[FloatArray],
    motions: Sequence[Motion],
    floor: float,
    kind: Kind,
) -> LawPicture | None:
    """Return a law over its own variable, or else over what it is most nearly a function of; None without either."""
    place = ACTS_AT.get(element, element)
    found = explain(without, place, floor)
    sign = DRIVES.get(element, 1.0)
    data = [sign * each.value for each in found.inputs]
    differences = [output - its for output, its in zip(outputs, without.outputs, strict=True)]
    everywhere = [np.ones(each.size, dtype=np.bool_) for each in differences]
    law = [sign * each.value for each in smoothed(without, differences, everywhere, place, found.rate, floor)]
    okay = without.problem.use
    best: LawPicture | None = None
    own = OWN_AXES.get(name)
    for axis in AXES[element] if own is None else (own,):
        x = [axis.values(motion, without) for motion in motions]
        if axis.without is None:
            binned = binned_by_pass(x, data, law, okay)
        else:
            base = [axis.without(motion, without) for motion in motions]
            binned = binned_by_pass(x, _sums(data, base), _sums(law, base), okay)
        if binned is not None and (best is None or binned.explained > best.explained + 1e-9):
            labels = (name, element, axis.name, signal_unit(axis.dimension, kind), input_unit(place, without, kind))
            best = LawPicture(*labels, *binned.arrays, binned.explained)
    return best if best is not None and (own is not None or best.explained >= Places.FUNCTION) else None


def _sums(first: Sequence[FloatArray], second: Sequence[FloatArray]) -> list[FloatArray]:
    return [a + b for a, b in zip(first, second, strict=True)]


def courses_of(runs: FreeRuns) -> tuple[Trace, ...]:
    """Return the simulations of every recording, for plots; those kept out of the fit last."""
    line, kept_out, grid = runs.unseen.line, runs.unseen.chain.records, runs.retuned.problem.grid

    def nominal(records: Sequence[Record]) -> tuple[FloatArray, ...]:
        return fit(make_problem(line, records, (), grid=grid)).outputs

    outputs = (nominal(runs.chain.records), runs.as_read.outputs, runs.chain.read(runs.final.outputs))
    traces = [_trace(record, each, False) for record, *each in zip(runs.chain.raw, *outputs, strict=True)]
    if kept_out:
        use = all_good_samples(kept_out)
        outputs = (
            nominal(kept_out),
            foreign_outputs(runs.retuned, line, kept_out, use, NOTHING),
            foreign_outputs(runs.final, line, kept_out, use, runs.believed.effects),
        )
        traces += [_trace(record, each, True) for record, *each in zip(kept_out, *outputs, strict=True)]
    return tuple(traces)


def _trace(r: Record, runs: Sequence[FloatArray], holdout: bool) -> Trace:
    nominal, retuned, augmented = runs
    return Trace(r.name, r.time_s, r.torque_nm, r.output, r.okay, nominal, retuned, augmented, holdout)


def discrepancy(
    retuned: FitResult, final: FitResult, floor: float, motion: model.Motion = model.Motion.ROTATION
) -> Discrepancy:
    """Look at what a re-tuned model lacks, with the effects found."""
    inputs = explain_all(retuned, floor)
    motions = [motion_of(final, i, is_between=True) for i in range(len(final.problem.records))]
    spectrum, by_recording = error_spectrum(retuned, final, floor), responses(retuned, final)
    likeliest = max(inputs.values(), key=lambda each: each.log_likelihood)
    return Discrepancy(
        element=likeliest.place,
        equivalents=_equivalents(retuned, inputs, likeliest.log_likelihood, motion),
        spectrum=spectrum,
        responses=by_recording,
        pictures=pictures_of_effects(effects_added(retuned, final), final, motions, floor, motion),
    )


def effects_added(retuned: FitResult, final: FitResult) -> tuple[str, ...]:
    """Return the effects with shared parameters that a fit has beyond another, in the catalogue's order."""
    before = {shared.effect for shared in retuned.problem.shared}
    after = {shared.effect for shared in final.problem.shared}
    return tuple(name for name in (*EFFECTS, *final.problem.grid.laws) if name in after - before)


def _equivalents(
    retuned: FitResult,
    inputs: Mapping[Element, Explanation],
    most: float,
    motion: model.Motion,
) -> tuple[Equivalent, ...]:
    return tuple(
        Equivalent(
            "sensor" if place is Element.SPEED_SENSOR else place.value,
            input_unit(place, retuned, motion),
            _courses(retuned.problem.records, explanation),
            explanation.log_likelihood,
            2.0 * (most - explanation.log_likelihood) <= Noise.VERY_STRONG,
        )
        for place, explanation in inputs.items()
    )


def _courses(records: Sequence[Record], explanation: Explanation) -> Mapping[str, Course]:
    return {
        record.name: Course(record.time_s, found.value, found.value - Z95 * found.std, found.value + Z95 * found.std)
        for record, found in zip(records, explanation.inputs, strict=True)
    }


def pictures_of_effects(
    named: Sequence[str], final: FitResult, motions: Sequence[Motion], floor: float, motion: model.Motion
) -> tuple[LawPicture, ...]:
    """Return the laws of some effects as the recordings show them, with the rest of the fit taken out."""
    drawn = [
        picture(name, EFFECTS[name].element, without_effect(final, name), final.outputs, motions, floor, motion)
        for name in named
    ]
    return tuple(each for each in drawn if each is not None)


def without_effect(result: FitResult, name: str) -> FitResult:
    """Return a fit with one effect's shared parameters at their nulls and all else as it is, simulated."""
    nulls = {parameter.name: parameter.null for parameter in EFFECTS[name].shared_parameters}
    kept = [j for j, shared in enumerate(result.problem.shared) if shared.effect != name]
    p = result.problem.p.copy()
    for shared in result.problem.shared:
        if shared.effect == name:
            p[shared.slot] = nulls[shared.name]
    count = len(result.problem.shared)
    x = np.concatenate([result.x[kept], result.x[count:]])
    problem = replace(result.problem, p=p, shared=tuple(result.problem.shared[j] for j in kept))
    columns = [*kept, *range(count, result.x.size)]
    return replace(result, problem=problem, x=x, derivative=result.jacobian[:, columns], outputs=outputs_at(problem, x))
