"""What was identified, in sentences an engineer would write."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from estimator.identification.modes.modes import Mode
from estimator.identification.modes.propagate import Uncertain
from estimator.identification.online.recursive import Status
from estimator.identification.study import Study
from hil.figures.local_model import LocalModel
from hil.report.numbers import shown
from hil.report.wording import listed

FAR_APART = 0.03
"""On-line and off-line frequency further apart than this share are worth a warning: docs/identification.md."""


LITTLE_PERCENT = 50.0
"""Free-run fit below which most of the output comes from elsewhere than from the torque."""


def headline(studies: Sequence[Study]) -> str:
    """Return the result in a line."""
    modes = [each.resonance for each in studies if each.resonance is not None]
    if not modes:
        return "No lightly damped mode in the band"
    frequencies = [mode.frequency_hz.value for mode in modes]
    dampings = [mode.damping.value for mode in modes]
    return f"Resonance at {_span(frequencies, 'Hz')}, damping {_span(dampings)}"


def _span(values: Sequence[float], unit: str = "") -> str:
    low, high = (f"{value:.3g}" for value in (min(values), max(values)))
    return f"{low if low == high else f'{low} to {high}'} {unit}".rstrip()


def statement(models: Sequence[LocalModel], studies: Sequence[Study]) -> str:
    """Return the paragraph a report begins with: what was identified from what, how sure, how good, how it checks."""
    first = studies[0].found
    orders = first.online.orders
    seconds = sum(float(np.count_nonzero(m.record.okay)) * m.record.sample_time_s for m in models)
    count = f"{len(models)} recordings" if len(models) > 1 else f"recording {models[0].name}"
    text = (
        f"From {count}, {seconds:.0f} s of good samples, models with nA = {orders.na}, nB = {orders.nb} and a total "
        f"delay of {orders.nk} were identified at {1e3 * first.online.sample_time_s:g} ms, on line by OEFO and off "
        "line by an output-error fit."
    )
    modes = [each.resonance for each in studies if each.resonance is not None]
    if modes:
        widest = max(mode.frequency_hz.ci95[1] - mode.frequency_hz.ci95[0] for mode in modes) / 2.0
        text += f" Off line the resonance is known to ± {shown(widest, 'Hz')} in each (95 %)."
    fits = [each.validation.own.fit_percent for each in studies]
    text += f" Simulated in free run, the off-line model reproduces {_span(fits, '%')} of its recording"
    unseen = [run.fit_percent for each in studies for run in each.validation.unseen]
    return text + (f" and {_span(unseen, '%')} of the others." if unseen else ".")


def warnings(studies: Sequence[Study]) -> list[str]:
    """Return what a reader must know before believing it."""
    told = []
    for each in studies:
        estimate = each.found.estimate
        if estimate.status is not Status.ESTIMATED:
            told.append(f"{each.name}: the on-line estimate is {estimate.status.value}: {estimate.reason.message}.")
        if (fit := each.found.batch.fit_percent) < LITTLE_PERCENT:
            told.append(
                f"{each.name}: the off-line model reproduces {fit:.0f} % of its recording: most of the speed comes "
                "from elsewhere than from the torque, and a resonance of such a model is none to believe. Raise the "
                "PRBS or record longer."
            )
        if each.feedback is not None and each.feedback.detected:
            told.append(f"{each.name}: {each.feedback.statement}")
        if apart := _apart(each.found.online_resonance, each.found.batch_resonance):
            told.append(f"{each.name}: on line and off line differ by {100.0 * apart:.1f} % in frequency.")
    if missed := [each.name for each in studies if not each.validation.independence.is_independent]:
        told.append(
            f"In {listed(missed)} the residual still depends on the input: the models miss a part of the response. "
            "Resonance and damping can be right all the same; look at the frequency response and the residual tests."
        )
    return told


def _apart(online: Mode | None, offline: Mode | None) -> float:
    if online is None or offline is None:
        return 0.0
    apart = abs(online.frequency_hz / offline.frequency_hz - 1.0)
    return apart if apart > FAR_APART else 0.0


def plus_minus(value: Uncertain, unit: str = "") -> str:
    """Return an estimate with the half width of its 95 % interval."""
    low, high = value.ci95
    half = (high - low) / 2.0
    if not 0.0 < half < math.inf:
        return shown(value.value, unit)
    places = max(1 - math.floor(math.log10(half)), 0)  # two digits of what is not known
    return f"{value.value:.{places}f} ± {half:.{places}f} {unit}".rstrip()
