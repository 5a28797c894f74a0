"""The statement: one paragraph made from verdict, errors, effects and effort, and from nothing else."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from estimator.diagnosis.result import (
    Doubt,
    Effort,
    Fit,
    FoundEffect,
    OffNominal,
    Remainder,
    Slight,
    UntestableEffect,
    Verdict,
)
from estimator.diagnosis.thresholds import Telling
from estimator.physics.catalogue import title_of
from estimator.physics.effect import Element

PLACES: Mapping[Element, str] = {
    Element.TORQUE_PATH: "in the torque path",
    Element.MOTOR: "at the motor",
    Element.SHAFT: "in the shaft",
    Element.LOAD: "at the load",
    Element.SPEED_SENSOR: "in the reading",
    Element.ACQUISITION: "in the acquisition",
}

LINE = frozenset({"J_M", "J_L", "k"})  # what a line's answer to a torque is in proportion to


def times(ratio: float) -> str:
    """Return a multiple to three digits as people write it: 281 and not 2.81e+02."""
    return f"{float(f'{ratio:.3g}'):.0f}" if ratio >= Telling.WHOLE_FROM else f"{ratio:.3g}"


@dataclass(frozen=True, slots=True)
class Context:
    """What a statement adds to the verdict."""

    remainder: Remainder | None = None  # error that no effect explains
    traces: Sequence[Slight] = ()  # effects that are there and matter little
    refinements: Sequence[str] = ()  # effects that may be there and are not established
    off_nominal: Sequence[OffNominal] = ()  # values that left their data sheet
    untestable: Sequence[UntestableEffect] = ()  # effects that these recordings can't show
    can_be_retuned: bool = True  # false for a plant whose parameters are not fitted
    element: Element | None = None  # where the mismatch most likely is
    alone: Element | None = None  # where an input by itself would most likely act
    doubts: Sequence[Doubt] = ()  # about the input: they come first


def statement(
    verdict: Verdict, fit: Fit, effects: Sequence[FoundEffect], effort: Effort, context: Context = Context()
) -> str:
    """Return one paragraph: verdict, figures, and what to do next."""
    parts = [_doubted(context.doubts)] if context.doubts else []
    parts += [] if effort.finished else [_not_decided(effort)]
    parts.append(_headline(verdict, fit, effects, effort, context))
    if context.remainder is not None and not context.off_nominal:
        parts.append(_left(verdict, context.remainder, context.element, context.alone))
    if effort.finished and effort.untried and context.remainder is not None and not context.off_nominal:
        parts.append(_not_all_fitted(effort))
    if context.traces:
        for reason in dict.fromkeys(each.reason for each in context.traces):
            titles = [title_of(each.name) for each in context.traces if each.reason == reason]
            parts.append(f"Seen, but {reason}: {', '.join(titles)}.")
        parts += [_moving(each) for each in context.traces if each.moves]
    if context.refinements:
        parts.append(f"Not established, and not in the model: {', '.join(map(title_of, context.refinements))}.")
    twins = sorted({twin for effect in effects for twin in effect.indistinguishable_from})
    if twins:
        others = " or ".join(map(title_of, twins))
        parts.append(f"These recordings could as well be explained by {others}: what was counted is that one is there.")
    tests = sorted({entry.suggested_test for entry in context.untestable if not entry.needs})
    if tests:
        names = ", ".join(title_of(entry.name) for entry in context.untestable if not entry.needs)
        parts.append(f"Neither found nor excluded by these recordings: {names}. Record a {' or a '.join(tests)}.")
    parts += [
        f"Neither found nor excluded without {e.needs}: {title_of(e.name)}." for e in context.untestable if e.needs
    ]
    return " ".join(parts)


def _doubted(doubts: Sequence[Doubt]) -> str:
    return (
        f"The input is in doubt (recordings: {', '.join(each.about for each in doubts)}). If it is right all the same:"
    )


def _moving(trace: Slight) -> str:
    """Say what a trace does to the values that are reported, though it hardly moves the error."""
    moved = ", ".join(f"{name} by {100.0 * share:+.2g} %" for name, share in trace.moves.items())
    return f"The values are those with {title_of(trace.name)}: without it, {moved}."


def _not_decided(effort: Effort) -> str:
    count = len(effort.untried)
    among = ", ".join(map(title_of, effort.untried[: Telling.MOST_NAMES])) + (
        ", …" if count > Telling.MOST_NAMES else ""
    )
    left = f", {count} of {effort.candidates} effects untried, among them {among}" if count else ""
    return f"Not decided: the search was ended after {effort.limit_s:.3g} s{left}."


def _not_all_fitted(effort: Effort) -> str:
    """Say which effects might explain what is left, as far as anybody has looked, and how one of them is fitted."""
    return (
        f"Not all effects were fitted, and one of these may be the cause: {', '.join(map(title_of, effort.untried))}. "
        f"Others promised more. To have one fitted, write it into the model file as [effects.{effort.untried[0]}] or "
        "the like, its values with a tolerance, and diagnose again."
    )


def _headline(verdict: Verdict, fit: Fit, effects: Sequence[FoundEffect], effort: Effort, context: Context) -> str:
    model = "re-tuned inside its tolerances, the nominal model" if context.can_be_retuned else "the model"
    noise = f" at a noise of {fit.noise_floor:.3g} {fit.unit}" if math.isfinite(fit.noise_floor) else ""
    left = f"{model} leaves a free-run error of {fit.retuned:.3g} {fit.unit}{noise}"
    if not effort.finished:
        so_far = f"So far {left}. " if math.isfinite(fit.retuned) else ""
        return f"{so_far}Give it more time (--budget-s), or fewer or shorter recordings."
    if verdict is Verdict.NO_MISMATCH:
        return (
            f"Nothing is missing: {model} leaves nothing but the noise and slow drift of the readings ({_noise(fit)})."
        )
    found = "; ".join(effect.statement for effect in effects)
    if context.off_nominal and verdict is Verdict.UNEXPLAINED:
        return _wrong_values(left, context.off_nominal)
    if verdict is Verdict.UNEXPLAINED:
        also = f" Found in the acquisition, and not the cause: {found}." if effects else ""
        return f"Something is missing in the model, and no effect {effort.fitted} explains it: {left}.{also}"
    part = "the mismatch" if verdict is Verdict.EXPLAINED else "part of the mismatch"
    return f"Missing in the model{how_sure(effects)}: {found}. This explains {part}: {_fall(fit)}."


def _fall(fit: Fit) -> str:
    text = f"the free-run error {_change(fit.retuned, fit.augmented)} {fit.unit}"
    if math.isfinite(fit.holdout_retuned) and math.isfinite(fit.holdout_augmented):
        text += f", on samples not used for the fit it {_change(fit.holdout_retuned, fit.holdout_augmented)} {fit.unit}"
    return text


def _change(before: float, after: float) -> str:
    one, other = _pair(before, after)
    if one == other or abs(after - before) < Telling.STAYS * before:
        return f"stays at {one}"
    return f"{'falls' if after < before else 'rises'} from {one} to {other}"


def _pair(before: float, after: float) -> tuple[str, str]:
    """Return two numbers with as many digits as it takes to tell them from each other, up to six."""
    for digits in range(3, 7):
        one, other = (f"{value:.{digits}g}" for value in (before, after))
        if one != other:
            break
    return one, other


def _round(value: float) -> str:
    return f"{float(f'{value:.3g}'):g}"


def _noise(fit: Fit) -> str:
    return f"free-run error {fit.retuned:.3g} {fit.unit}, noise {fit.noise_floor:.3g} {fit.unit}"


def how_sure(effects: Sequence[FoundEffect]) -> str:
    """Say how often names of such a standing were right, of the least sure of them; nothing of faults of readings."""
    counts = [each.counted for each in effects if each.counted is not None]
    if not counts:
        return ""
    least = min(counts, key=lambda each: each.probability)
    together = ", each by itself" if len(counts) > 1 else ""
    return f"{'' if least.is_sure else ', probably'} ({least.words}{together})"


def _wrong_values(left: str, off_nominal: Sequence[OffNominal]) -> str:
    return (
        f"No physics need be missing, but the data sheet is off: {off_the_sheet(off_nominal)}. With that the nominal "
        f"model explains the recordings down to the noise; {left}. {_common_factor(off_nominal)}Check the data sheet, "
        "or widen the tolerance where it is a guess, and diagnose again."
    )


def _common_factor(off_nominal: Sequence[OffNominal]) -> str:
    """Say what else makes all values of a line wrong by one factor: it answers to a torque that was not read so."""
    ratios = [each.ratio for each in off_nominal]
    middle = sum(ratios) / len(ratios)
    least_trusted = max(each.tolerance for each in off_nominal)
    if not LINE <= {each.name for each in off_nominal} or max(ratios) - min(ratios) > least_trusted * middle:
        return ""
    return (
        f"All of them are about {middle:.2g} times their nominal values, which is the same as a torque of "
        f"{1.0 / middle:.2g} times what was read: check first that every input is recorded, alive and in Nm. "
    )


def off_the_sheet(off_nominal: Sequence[OffNominal]) -> str:
    """Say which nominal values are outside the tolerance of their data sheet, and by how much."""
    parts = []
    for each in off_nominal:
        trusted = f"{100.0 * each.tolerance:.2g} %"
        if each.nominal is None:
            side = "above" if each.ratio > 1.0 else "below"
            parts.append(f"{each.name} {100.0 * abs(each.ratio - 1.0):.2g} % {side} its nominal value (± {trusted})")
        else:
            value, unit = each.ratio * each.nominal, f" {each.unit}" if each.unit else ""
            parts.append(
                f"{each.name} is {_round(value)}{unit}, the data sheet says {_round(each.nominal)} ± {trusted}"
            )
    return " and ".join(parts)


def _left(verdict: Verdict, remainder: Remainder, element: Element | None, alone: Element | None) -> str:
    noise, without = times(remainder.times_noise), "" if remainder.element is None else " without the law below"
    if verdict is Verdict.PARTLY_EXPLAINED:
        share = f"{100.0 * remainder.share:.0f} %" if remainder.share >= 0.005 else "Less than 1 %"
        return (
            f"{share} of the squared error is left{without}, {noise} times the noise, and it is not noise: it "
            f"{remainder.law}."
        )
    other = "" if alone in (None, element) else f"; an input by itself would most likely act {PLACES[alone]}"
    where = "" if element is None else f" Most likely it acts {PLACES[element]}{other}."
    return f"What is left{without} is {noise} times the noise, and it is not noise: it {remainder.law}.{where}"


def compared(worse: float) -> str:
    """Say by how much a score is worse than that of what is believed; one that is better is no ground to reject it."""
    if abs(worse) < Telling.NO_WORSE:
        return "as good as without"
    if worse < 0.0:
        return (
            "more probable than what is believed, less than sets of as many effects that were tried and not established"
        )
    return f"worse by {worse:.3g} in minus twice the log-probability"
