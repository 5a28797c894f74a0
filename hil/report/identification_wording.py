"""What was identified, in sentences an engineer would write."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from estimator.diagnosis.preconditions.channels import dead_torques
from estimator.identification.best import SEEN, ModelVerdict
from estimator.identification.identify import Study
from estimator.identification.joint import Together
from estimator.identification.modes.modes import Uncertain
from estimator.identification.offline.validation import Validation
from estimator.identification.online.recursive import Status
from estimator.signals.record import Record
from hil.figures.local_model import LocalModel
from hil.report.numbers import listed, shown

WORTH_A_WARNING = 0.03
"""On-line and off-line frequency further apart than this share are worth a warning: docs/identification.md."""

LITTLE_PERCENT = 50.0
"""Free-run fit below which most of the output comes from elsewhere than from the torque."""

ADVICE = {
    ModelVerdict.GOOD: ("the linear model is good", ""),
    ModelVerdict.NOT_LINEAR: (
        "the drive is not linear, and its damping depends on {depends}",
        " Take frequency and damping for this torque only; hil diagnose names the cause.",
    ),
    ModelVerdict.CLOSED_LOOP: (
        "the torque follows the speed (closed loop); the Box-Jenkins model allows for that, the output-error, "
        "recursive and spectral estimates may be biased",
        " Hold the torque constant except for the PRBS, or use the Box-Jenkins model.",
    ),
    ModelVerdict.NOT_EXCITED: ("no pole pair: {reason}", " Raise the PRBS, record longer or faster; or there is none."),
    ModelVerdict.INCOMPLETE: (
        "the model misses a part of the response to past torque",
        " Look at the residual tests; try --order auto, or diagnose the recording.",
    ),
    ModelVerdict.ONE_MASS: ("one mass: {reason}", " If the shaft is soft, raise the PRBS, record longer or faster."),
}
"""What each verdict says of a recording, and what to do."""


LEAST_BAND_HZ = 25.0
"""Driveline resonances are common up to here; of a recording that can't show them the page says so."""


def verdict(each: Study) -> str:
    """Return one sentence: whether to believe the linear model of a recording, and what to do."""
    best = each.best
    says, cure = ADVICE[best.verdict]
    text = f"{each.name}: {says.format(depends=best.linearity.depends_on, reason=best.reason)}.{cure}"
    if best.too_slow and best.mode is not None:
        f, period_s = best.mode.frequency_hz.value, best.fit.model.sample_time_s
        text += (
            f" {1.0 / (f * period_s):.1f} samples in a period of {f:.3g} Hz are too few for its damping: record every "
            f"{1e3 / (10.0 * f):.2g} ms. A mode above {0.5 / period_s:.3g} Hz would look the same, folded down to it."
        )
    elif best.band_hz[1] < LEAST_BAND_HZ:
        text += (
            f" Sampled every {1e3 * best.fit.model.sample_time_s:g} ms, no mode above {best.band_hz[1]:.3g} Hz can be "
            f"seen: record every {1e3 * SEEN * 0.5 / LEAST_BAND_HZ:g} ms or faster."
        )
    if disagreement := _disagreement(each):
        off = f"{100.0 * disagreement:.1f} %"
        text += f" The on-line estimate is {off} off in frequency: see its course before you use it."
    return text


def best_statement(each: Study) -> str:
    """Return the best estimate in a sentence, or why there is none."""
    best = each.best
    if best.mode is None:
        return f"No resonance between {best.band_hz[0]:g} and {best.band_hz[1]:.3g} Hz: {best.reason}."
    text = (
        f"Resonance at {plus_minus(best.mode.frequency_hz, 'Hz')}, damping {plus_minus(best.mode.damping)} (95 %), by "
        f"a Box-Jenkins model of order {best.fit.model.orders.na} at {1e3 * best.fit.model.sample_time_s:g} ms."
    )
    if best.regions:
        seen = "; ".join(
            f"{one.low:.0f} to {one.high:.0f} Nm: "
            + ("none" if one.mode is None else f"{one.mode.frequency_hz:.3g} Hz, {one.mode.damping:.3f}")
            for one in best.regions
        )
        text += f" By torque in the shaft: {seen}."
    return text


def joint_statement(together: Together) -> str:
    """Return what several recordings say together in a sentence or two, or why they say nothing."""
    joint, reason = together
    if joint is None:
        return f"No joint estimate: {reason}."
    text = f"{listed(joint.names)} together: "
    text += (
        f"no resonance, {joint.reason}."
        if joint.mode is None
        else f"resonance at {plus_minus(joint.mode.frequency_hz, 'Hz')}, damping {plus_minus(joint.mode.damping)} "
        f"(95 %), by one Box-Jenkins model of order {joint.model.orders.na} with a noise model for each."
    )
    if joint.disagreeing:
        left_out = ", ".join(f"{name} (p = {p_value:.2g})" for name, p_value in joint.disagreeing.items())
        text += f" Left out, not the same line as the others: {left_out}."
    if joint.doubtful:
        text += f" The model is not a good one of {listed(joint.doubtful)} by itself: the intervals may be too narrow."
    return text


def headline(studies: Sequence[Study]) -> str:
    """Return the result in a line."""
    modes = [each.resonance for each in studies if each.resonance is not None]
    if not modes:
        return "No resonance that the data need"
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
        f"From {count}, {seconds:.0f} s of good samples: off line by Box-Jenkins and output-error models at "
        f"{1e3 * first.batch.model.sample_time_s:g} ms, on line by OEFO with nA = {orders.na}, nB = {orders.nb} and a "
        f"total delay of {orders.nk} at {1e3 * first.online.sample_time_s:g} ms."
    )
    modes = [each.resonance for each in studies if each.resonance is not None]
    if modes:
        widest = max(mode.frequency_hz.ci95[1] - mode.frequency_hz.ci95[0] for mode in modes) / 2.0
        text += f" The resonance is known to ± {shown(widest, 'Hz')} in each (95 %)."
    low, high = studies[0].best.band_hz
    text += f" It was sought between {low:g} and {high:.3g} Hz, as the sampling allows."
    fits = [each.validation.own.fit_percent for each in studies]
    text += f" Simulated in free run, the output-error model reproduces {_span(fits, '%')} of its recording"
    unseen = [run.fit_percent for each in studies for run in each.validation.unseen]
    return text + (f" and {_span(unseen, '%')} of the others." if unseen else ".")


def warnings(records: Sequence[Record], studies: Sequence[Study]) -> list[str]:
    """Return what a reader must know before believing it."""
    texts = [text for record in records for text in dead_torques(record)]
    for each in studies:
        estimate = each.found.estimate
        if estimate.status is not Status.ESTIMATED:
            texts.append(f"{each.name}: the on-line estimate is {estimate.status.value}: {estimate.reason.message}.")
        if (fit := each.found.batch.fit_percent) < LITTLE_PERCENT:
            texts.append(
                f"{each.name}: the off-line model reproduces {fit:.0f} % of its recording: most of the speed is "
                "not caused by the torque. Do not trust a resonance of such a model. Raise the PRBS or record longer."
            )
    for each in studies:
        used_s, whole_s = (x.time_s.shape[0] * x.sample_time_s for x in (each.found.offline, each.found.data))
        if used_s < 0.99 * whole_s:
            texts.append(
                f"{each.name}: off line the first {used_s / 60.0:.0f} of {whole_s / 60.0:.0f} min are used. Cut the "
                "recording for another part."
            )
    missed = [each.name for each in studies if not _passed(each.validation) and not _passed(each.best.validation)]
    if missed:
        texts.append(
            f"In {listed(missed)} the residual still depends on the input: the models miss a part of the response."
        )
    return texts


def _passed(validation: Validation) -> bool:
    return validation.independence.is_independent


def _disagreement(each: Study) -> float:
    """Return by how much on-line and best frequency differ, relative; 0 where they agree or one is missing."""
    online, best = each.found.online_resonance, each.resonance
    if online is None or best is None:
        return 0.0
    disagreement = abs(online.frequency_hz / best.frequency_hz.value - 1.0)
    return disagreement if disagreement > WORTH_A_WARNING else 0.0


def plus_minus(value: Uncertain, unit: str = "") -> str:
    """Return an estimate with the half width of its 95 % interval."""
    low, high = value.ci95
    half = (high - low) / 2.0
    if not 0.0 < half < math.inf:
        return shown(value.value, unit)
    places = max(1 - math.floor(math.log10(half)), 0)  # two digits of what is not known
    return f"{value.value:.{places}f} ± {half:.{places}f} {unit}".rstrip()
