"""The verdict: what the chosen effects, the rivals without a name and what remains add up to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from estimator.diagnosis.acquisition import Finding
from estimator.diagnosis.beyond import in_words
from estimator.diagnosis.convergence import unconverged
from estimator.diagnosis.evidence import VERY_STRONG, Gain, delta_bic_with, gain, information, noise_level, price
from estimator.diagnosis.hypotheses import crowding, flexible
from estimator.diagnosis.phrases import PLACE_NAMES, kind_in_words
from estimator.diagnosis.result import Stray, Verdict
from estimator.diagnosis.selection import Selection
from estimator.diagnosis.trial import scan_choices
from estimator.diagnosis.unnamed import LAGS, UnnamedLaw
from estimator.diagnosis.weight import (
    BELIEVED_TOGETHER,
    SEEN,
    VISIBLE,
    least_share,
    leaves_a_detail,
    reads_speed,
    share_removed,
)
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult

MOST_VISIBLE = 0.9
"""Share of the mismatch's power that an explanation must take away where what it leaves is seen above the noise."""

NEAR_FLOOR = 1.5
"""Error over the noise floor that an explanation may leave: another way to write the same law leaves that much."""

NEAR_FLOOR_DETAIL = 2.5
"""The same where that is next to nothing of the mismatch."""

NEAR_FLOOR_PROFILE = SEEN
"""The same for a profile over time, which follows whatever is slow: what it leaves is something else."""

HARMONICS = 0.05
"""Share of the mismatch's power that a wave over an angle may leave, however far above the noise: no machine's is a
pure sine, and a harmonic of a fifth of the amplitude has a twenty-fifth of the power."""

FAR_BETTER = 0.5
"""Share of what an explanation leaves above the noise that a simpler law at the same place leaves at most, where that
law is another."""

ABOVE_FLOOR = 1.25
"""A re-tuned nominal model whose error is above the floor by this factor does not explain a speed recording: the
torque reading's own noise adds a few per cent, the estimate of the floor errs upward."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """The verdict and what it rests on.

    Attributes
    ----------
    unnamed : UnnamedLaw or None
        The best law without a name for what the re-tuned nominal leaves, where it counts.
    remaining : UnnamedLaw or None
        The best one for what the chosen effects leave, where it counts.
    objection : str
        Why chosen effects are not believed; empty where they are, or where there are none.
    unconverged : tuple of str
        What there is to say of fits that did not converge.
    strays : tuple of Stray
        Nominal parameters that alone, beyond what they are trusted to, would explain the mismatch to the noise.
    """

    verdict: Verdict
    unnamed: UnnamedLaw | None
    remaining: UnnamedLaw | None
    objection: str = ""
    unconverged: tuple[str, ...] = ()
    strays: tuple[Stray, ...] = ()


def judge(selection: Selection, floor: float, findings: Sequence[Finding] = ()) -> Judgement:
    """Weigh the selection against laws without a name and against the noise floor.

    ``findings`` are faults of the acquisition, already compensated: with nothing else missing they are the explanation.
    """
    unnamed = selection.unnamed
    if not selection.chosen:
        shaken = any(finding.name == "sample_jitter" for finding in findings)
        standing = (_above_floor(selection, floor) and not shaken) or unnamed is not None
        clean = Verdict.EXPLAINED if findings else Verdict.NO_MISMATCH
        strays = _strays(selection, floor) if standing else ()
        return Judgement(Verdict.UNEXPLAINED if standing else clean, unnamed, None, "", unconverged(selection), strays)
    remaining = selection.remaining
    objection = _objection(selection, floor, unnamed, remaining)
    verdict = Verdict.UNEXPLAINED if objection else Verdict.EXPLAINED
    strays = _strays(selection, floor) if objection else ()
    return Judgement(verdict, unnamed, remaining, objection, unconverged(selection), strays)


def _strays(selection: Selection, floor: float) -> tuple[Stray, ...]:
    """Return the nominal parameters that explain the mismatch to the noise where they are not held back."""
    if selection.beyond is None:
        return ()
    result = selection.beyond.result
    return selection.beyond.strays if result.rms <= VISIBLE * noise_level(result, floor) else ()


def _says_more(selection: Selection, line: FitResult) -> bool:
    """Tell whether what was chosen explains clearly more than a fit of the nominal line beyond its tolerances."""
    n = gain(selection.retuned, min(line, selection.result, key=lambda fit: fit.squares)).n_effective
    return information(line, selection.result, n) >= VERY_STRONG


def _above_floor(selection: Selection, floor: float) -> bool:
    return reads_speed(selection.retuned) and selection.retuned.rms > ABOVE_FLOOR * floor


def _leaves_too_much(selection: Selection, floor: float, profile_alone: bool) -> str:
    """Say how much an explanation leaves, where that is too much; "" where it is not.

    Near to the noise is asked of a speed only: a free-running position drifts away from any model.
    """
    after, level = selection.result.rms, floor
    if all(record.torque_trusted.all() for record in selection.result.problem.records):
        level = noise_level(selection.result, floor)
    if after < VISIBLE * level and selection.remaining is None:
        return ""  # what is left is the noise of the reading and of the torque's
    share, least = share_removed(selection.retuned, selection.result, level), least_share(selection.result)
    if not reads_speed(selection.result):
        return f"{1.0 - share:.0%} of the mismatch" if share < least else ""
    if all(EFFECTS[name].phases for name in selection.chosen) and share >= 1.0 - HARMONICS:
        return ""
    if leaves_a_detail(selection.retuned, selection.result, floor):
        bends = any(EFFECTS[name].profile for name in selection.chosen)
        most = NEAR_FLOOR if bends else NEAR_FLOOR_DETAIL
    else:
        most = NEAR_FLOOR_PROFILE if profile_alone else NEAR_FLOOR
    seen = after > SEEN * level
    if share < (MOST_VISIBLE if seen else least) or after > most * level:
        return f"{1.0 - share:.0%} of the mismatch, {after / level:.2g} times the noise"
    return ""


def _is_seen(selection: Selection, floor: float) -> bool:
    """Tell whether what an explanation leaves is seen above the noise."""
    return selection.result.rms > SEEN * noise_level(selection.result, floor)


def _is_simpler(unnamed: UnnamedLaw, selection: Selection) -> bool:
    """Tell whether a law without a name explains as much with clearly less, both told with one number of samples.

    What it gains must be a lower price, or an error that is visibly smaller: for more, a law in other words takes up
    the details that a named one leaves at the noise, such as the second wave of an imbalance.
    """
    before, after = selection.retuned.rms, selection.result.rms
    named = _gain_of_names(selection)
    n = unnamed.gain.n_effective if unnamed.rms < after else named.n_effective
    rival = delta_bic_with(unnamed.gain, before, unnamed.rms, n)
    cheaper = price(unnamed.gain, before, unnamed.rms) < price(named, before, after)
    better = rival > delta_bic_with(named, before, after, n) + VERY_STRONG
    return better and (cheaper or after >= VISIBLE * unnamed.rms)


def _gain_of_names(selection: Selection) -> Gain:
    """Return what the chosen effects gain, paid for as a law's gain is: each was one of all that were tried."""
    plain = gain(selection.retuned, selection.result)
    tried = len({*selection.chosen, *selection.trials, *selection.dismissed})
    choices = sum(math.log(tried) + scan_choices(name, selection.result) for name in selection.chosen)
    return replace(plain, delta_bic=plain.delta_bic - 2.0 * choices)


def _is_another_law(selection: Selection, floor: float, unnamed: UnnamedLaw) -> bool:
    """Tell whether a law at the same place leaves so much less that it can't be the named one in other words.

    A law of lags alone is none in other words that is not linear, however little that leaves, if a law is left.
    """
    entries = [EFFECTS[name] for name in selection.chosen]
    if any(entry.phases for entry in entries):  # a wave and its harmonics are sought one by one
        return False
    after, level = selection.result.rms, noise_level(selection.result, floor)
    left = max(unnamed.rms**2 - level**2, 0.0)
    lags = all(term in LAGS for term, _ in unnamed.terms) and not any(entry.linear for entry in entries)
    seen = _is_seen(selection, floor) or (lags and after >= VISIBLE * level and selection.remaining is not None)
    return seen and left < FAR_BETTER * (after**2 - level**2)


def _is_a_course(unnamed: UnnamedLaw, selection: Selection) -> bool:
    """Tell whether a law at the load begins with a course of one recording alone: it is a profile in other words."""
    own = tuple(f" in {record.name}" for record in selection.result.problem.records)
    return unnamed.element is Element.LOAD and unnamed.terms[0][0].endswith(own)


def _bends(selection: Selection, floor: float, profile_alone: bool) -> bool:
    """Tell whether what bends is among the chosen and leaves more than a detail: an edge in what should be smooth.

    A profile alone, or two that bend at one place, follow so much that what they leave need not be seen.
    """
    much = profile_alone or bool(crowding(selection.chosen))
    flexibly = much or (bool(flexible(selection.chosen)) and _is_seen(selection, floor))
    return flexibly and not leaves_a_detail(selection.retuned, selection.result, floor)


def _is_filtered(selection: Selection, floor: float) -> bool:
    """Tell whether several linear systems, or one of the line itself, do not reach the noise.

    A mode and a filter follow any other linear system, one of fractional order or a shaft that relaxes among them, as
    far as their orders go. And where they are what was left out there is no other way to write them that leaves a
    detail; but a lag or a filter alone, whose maker may have given it another order.
    """
    entries = [EFFECTS[name] for name in selection.chosen]
    able = len(entries) > 1 or entries[0].element is Element.SHAFT
    return able and all(entry.linear for entry in entries) and _is_seen(selection, floor)


def _objection(selection: Selection, floor: float, unnamed: UnnamedLaw | None, remaining: UnnamedLaw | None) -> str:
    named = " and ".join(EFFECTS[name].title for name in sorted(selection.chosen))
    if unconverged(selection):
        return f"{named} rests on a fit that did not converge"
    for name, trial in sorted(selection.accepted.items()):
        if trial.failed is not None:  # it passed beside fewer, or before its last fit
            return f"{EFFECTS[name].title} does not pass in the last fit: {trial.failed}"
    if selection.beyond is not None and not _says_more(selection, selection.beyond.result):
        return f"the nominal line itself would leave as little as {named}, with {in_words(selection.beyond.strays)}"
    profiles = [name for name in selection.chosen if EFFECTS[name].profile]
    alone = bool(profiles) and len(selection.chosen) == 1
    if leaves := _leaves_too_much(selection, floor, alone):
        return f"{named} would leave {leaves}"
    if remaining is not None and (_bends(selection, floor, alone) or _is_filtered(selection, floor)):
        law = kind_in_words(remaining.terms[0][0])
        return f"{named} would leave {law} at the {PLACE_NAMES[remaining.element]} unexplained"
    if unnamed is None or not reads_speed(selection.result):  # a free-running position drifts as any flexible law does
        return ""
    named_or_alike = {*selection.chosen, *(twin for twins in selection.lookalikes.values() for twin in twins)}
    elements = {EFFECTS[name].element for name in named_or_alike}
    another = bool(profiles) and not _is_a_course(unnamed, selection)
    elsewhere = another or unnamed.element not in elements or len(selection.chosen) > BELIEVED_TOGETHER
    if _is_simpler(unnamed, selection) and (elsewhere or _is_another_law(selection, floor, unnamed)):
        law = kind_in_words(unnamed.terms[0][0])
        return f"{law} at the {PLACE_NAMES[unnamed.element]} would explain it with less than {named}"
    if remaining is not None and remaining.element is unnamed.element and remaining.element not in elements:
        law = kind_in_words(remaining.terms[0][0])
        return (
            f"{named} would leave {law} at the {PLACE_NAMES[remaining.element]}, where the mismatch itself has its law"
        )
    return ""
