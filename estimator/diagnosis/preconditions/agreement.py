"""Are recordings of one line? The inertias and the stiffness that each fits by itself are compared.

The fit is that of ``identify``: a Box-Jenkins model of two masses and the drive behind it, with 95 % intervals. A
recording that such a line does not explain by itself is not compared: what its numbers differ by is physics, perhaps.
Nor are friction and damping: a dry friction, which a diagnosis is to find, makes a viscous one of any size.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from statistics import median

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.diagnosis.result import Doubt, FoundEffect
from estimator.diagnosis.thresholds import Mistakes
from estimator.diagnosis.wording import times
from estimator.errors import EstimatorError
from estimator.identification.best import band_of
from estimator.identification.modes.modes import Uncertain
from estimator.identification.modes.physical import RESPONDING, physical_parameters
from estimator.identification.offline.fits import fit_of, solved
from estimator.identification.offline.linearity import judge_linearity
from estimator.identification.offline.validation import validate
from estimator.physics.catalogue import EFFECTS
from estimator.physics.model import DrivelineModel, Structure, natural_frequencies_rad_s
from estimator.physics.steps import EDGE_S, inside
from estimator.signals.decimate import HIGH_PASS_HZ, first_part, high_passed
from estimator.signals.record import OutputKind, Record

COMPARED = ("J_M", "J_L", "k")  # and what one wrong scale of the torque changes by one factor


def disagreements(records: Sequence[Record], model: DrivelineModel) -> list[Doubt]:
    """Return a doubt for each recording that is not of the line that most of the others are of, and by how much."""
    found = {record.name: line for record in records if (line := _own_line(record, model)) is not None}
    asked = found if len(found) > 2 else list(found)[1:]  # of two, nobody knows which
    return [
        Doubt(
            name if len(found) > 2 else ", ".join(found),
            _statement(name, found, differing),
            Mistakes.BOTH_HOLD,
            differs=differing,
        )
        for name in asked
        if (differing := _differing(name, found))
    ]


def is_answered(
    doubt: Doubt,
    effects: Iterable[FoundEffect],
    model: DrivelineModel,
    line: Mapping[str, float],
    records: Sequence[Record],
) -> bool:
    """Tell whether a change of the line that was found in the recordings is what one of them differs by.

    ``line`` has the values before the change. It must begin or end while a recording runs: one between recordings may
    as well be another vehicle.
    """
    ratios = {}
    for each in effects:
        step = EFFECTS[each.name].step
        if step is not None and any(_begins_or_ends_in(record, each) for record in records):
            name, (size, *_) = step.of(model), each.parameters.values()
            ratios[name] = step.turned(line[name], size.value)[0] / line[name]
    return bool(doubt.differs) and all(
        name in ratios and _is_either_way(ratio, ratios[name]) for name, ratio in doubt.differs.items()
    )


def _begins_or_ends_in(record: Record, event: FoundEffect) -> bool:
    began = float(record.time_s[0] - record.since_start_s[0])
    spans = [span for span in event.time_s.get(record.name, ()) if span[1] - span[0] > EDGE_S]
    return any(inside(record, moment_s - began) for span in spans for moment_s in span)


def _is_either_way(ratio: float, change: float) -> bool:
    """Tell whether a ratio of two recordings is that of a change, whichever of them came first."""
    off = min(abs(math.log(ratio / change)), abs(math.log(ratio * change)))
    return off < math.log(Mistakes.LEAST_RATIO)


def _own_line(record: Record, model: DrivelineModel) -> Mapping[str, Uncertain] | None:
    """Return the drive that a recording fits by itself; None where it does not tell one."""
    if record.imposed is not None or record.load_nm is not None or record.kind is not OutputKind.SPEED:
        return None
    low_hz, high_hz = band_of(record)
    first_hz = float(natural_frequencies_rad_s(model.values())[0]) / (2.0 * math.pi)
    if model.structure is not Structure.TWO_MASS or not low_hz <= first_hz <= high_hz:
        return None
    try:
        with threadpool_limits(1), np.errstate(divide="ignore"):  # of a line that is none
            data = high_passed(first_part(record), HIGH_PASS_HZ)
            problem, x, first = solved(data, RESPONDING, Mistakes.NOISE_ORDER)
            fit = fit_of(problem, x, first)
            is_linear = judge_linearity(problem, x, first_part(record), first, HIGH_PASS_HZ).is_linear
            if not (is_linear and validate(fit, data).independence.is_independent):
                return None
            drive = physical_parameters(fit.model, fit.covariance, names=COMPARED)
    except EstimatorError:
        return None
    return {name: drive.parameters[name].estimate for name in COMPARED}


def _differing(name: str, found: Mapping[str, Mapping[str, Uncertain]]) -> dict[str, float]:
    """Return by how much which parameters of a recording differ from those of most others that determine them."""
    differing = {}
    for key, mine in found[name].items():
        others = [line[key] for other, line in found.items() if other != name and line[key].is_determined]
        unlike = [each.value for each in others if mine.is_determined and _differ(mine, each)]
        if 2 * len(unlike) > len(others):
            differing[key] = mine.value / median(unlike)
    return differing


def _differ(one: Uncertain, other: Uncertain) -> bool:
    (low, high), (its_low, its_high) = one.ci95, other.ci95
    return low > Mistakes.LEAST_RATIO * its_high or its_low > Mistakes.LEAST_RATIO * high


def _statement(name: str, found: Mapping[str, Mapping[str, Uncertain]], differing: Mapping[str, float]) -> str:
    said = ", ".join(f"its {key} fits {times(ratio)} times" for key, ratio in differing.items())
    ratios = list(differing.values())
    is_gain = len(ratios) == len(COMPARED) and max(ratios) < Mistakes.LEAST_RATIO * min(ratios)
    why = (
        f"as under a torque of {times(1.0 / ratios[0])} times what was read"
        if is_gain
        else "another vehicle, shaft or payload, or a change between them"
    )
    others = " and ".join(each for each in found if each != name)
    of = "those of the others" if len(found) > 2 else f"that of {others}"
    return (
        f"recording {name} is not of the line of {others}: {said} {of} ({why}). To diagnose the rest alone, leave "
        f"out {name}{'' if len(found) > 2 else f', or {others}'}."
    )
