"""Which fits are a case of their effects: values that a law can have, and a machine that its data sheet describes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.hypotheses import Effects, line_values
from estimator.diagnosis.inference.disturbances import Size
from estimator.diagnosis.inference.likelihood import Hypothesis
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element, Span
from estimator.physics.fit import FitResult
from estimator.physics.inputs import shaft_torque
from estimator.physics.model import DrivelineModel
from estimator.physics.motion import longest_s
from estimator.physics.steps import has_edge
from estimator.physics.unknowns import Shared
from estimator.signals.record import Record

GRADE = "road_grade"
"""The effect that is no law: a load that walks further than any load does by itself."""

LEAST_THROUGH, PARTS = 0.2, 4
"""Share of the torque's RMS that must get through the torque path in each of so many parts of a recording: less
switches the input off to explain nothing."""

LOOSE = 3.0
"""Factor by which a nominal parameter that an effect changes may be beyond its tolerance: a line that is split in two
equal springs has each twice as stiff as the whole."""

ROUNDING = 1e-6
"""Share of a value by which a fit may end beyond a bound."""


def is_possible(hypothesis: Hypothesis, records: Sequence[Record]) -> bool:
    """Tell whether a machine can be so: its input is on, it is not stuck, no load walks so far, events take place."""
    values, plain = _values_of(hypothesis), hypothesis.plain
    if GRADE in hypothesis.effects and _walk(hypothesis, records) > _most_torque(records):
        return False
    edges = all(has_edge(name, plain) for name in values if EFFECTS[name].event)
    return edges and _is_driven(plain, records) and not _is_stuck(values, records)


def is_plausible(hypothesis: Hypothesis, model: DrivelineModel, records: Sequence[Record]) -> bool:
    """Tell whether a machine can be so, and the values of every effect are a case of it."""
    values = _values_of(hypothesis)
    if any(EFFECTS[name].implausible(model, records, values[name]) for name in values):
        return False
    return is_possible(hypothesis, records) and _is_described(hypothesis, model)


def _values_of(hypothesis: Hypothesis) -> dict[str, Mapping[str, float]]:
    return {name: hypothesis.plain.values_of(name) for name in hypothesis.effects - {GRADE}}


def loosened(hypothesis: Hypothesis, model: DrivelineModel) -> FitResult | None:
    """Return a fit whose nominal parameters may leave their tolerances where its effects change them; None as it is.

    Those that are at a bound. Whether a data sheet's value is one that the line had at some moment is then for
    `is_plausible` to say.
    """
    plain = hypothesis.plain
    wide = _spans(hypothesis, model)
    shared = tuple(
        replace(each, low=each.low / LOOSE, high=each.high * LOOSE)
        if pinned and not each.effect and each.name in wide and _is_tight(each, model)
        else each
        for each, pinned in zip(plain.problem.shared, plain.pinned, strict=False)
    )
    if shared == plain.problem.shared:
        return None
    return replace(plain, problem=replace(plain.problem, shared=shared), converged=False)


def may_be_loose(shared: Shared, effects: Effects, model: DrivelineModel) -> bool:
    """Tell whether one of some effects changes a nominal parameter, so that it may leave its tolerance."""
    line = model.values()
    values = {name: dict.fromkeys((p.name for p in EFFECTS[name].parameters), 0.0) for name in effects - {GRADE}}
    return any(shared.name in EFFECTS[name].described(model, mine, line) for name, mine in values.items())


def _is_tight(shared: Shared, model: DrivelineModel) -> bool:
    return shared.low < shared.high <= 1.0 + model.parameters[shared.name].tolerance


def _spans(hypothesis: Hypothesis, model: DrivelineModel) -> dict[str, list[Span]]:
    """Return where data sheets' values of nominal parameters may lie that the effects change, by name."""
    plain, found = hypothesis.plain, dict[str, list[Span]]()
    line = line_values(plain)
    for name in hypothesis.effects - {GRADE}:
        for parameter, spans in EFFECTS[name].described(model, plain.values_of(name), line).items():
            found.setdefault(parameter, []).extend(spans)
    return found


def _is_described(hypothesis: Hypothesis, model: DrivelineModel) -> bool:
    """Tell whether every nominal value is, within its tolerance, one that the line had at some moment."""
    line = line_values(hypothesis.plain)
    for name, spans in _spans(hypothesis, model).items():
        given = model.parameters[name]
        low, high = (given.value * (1.0 + sign * (given.tolerance + ROUNDING)) for sign in (-1.0, 1.0))
        if not any(first <= high and low <= last for first, last in [*spans, (line[name], line[name])]):
            return False
    return True


def _is_driven(plain: FitResult, records: Sequence[Record]) -> bool:
    """Tell whether the torque path lets a real part of the torque through in every part of every recording."""
    for i, record in enumerate(records):
        through = shaft_torque(record.torque_nm, record.time_s - record.time_s[0], plain.p_of(i))
        for passed, read in zip(
            np.array_split(through, PARTS), np.array_split(record.total_torque_nm, PARTS), strict=True
        ):
            if float(passed @ passed) < LEAST_THROUGH**2 * float(read @ read):
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
