"""What a selection comes to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from estimator.diagnosis.beyond import LineBeyond
from estimator.diagnosis.evidence import VERY_STRONG
from estimator.diagnosis.hypotheses import Effects
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.selection.jury import SIGNIFICANT
from estimator.diagnosis.trial import Trial
from estimator.diagnosis.unnamed import ROUNDS, Hunt, UnnamedLaw, best_of, hunts_of, judged, scene
from estimator.diagnosis.weight import VISIBLE
from estimator.physics.fit import FitResult


@dataclass(frozen=True, slots=True)
class Selection:
    """The outcome of a selection.

    Attributes
    ----------
    chosen : frozenset of str
        The effects that earned their place; ``result`` is their fit, ``retuned`` the one without any.
    accepted : mapping of str to Trial
        Each chosen effect's last trial.
    trials : mapping of str to Trial
        The first trial of every effect that was fitted.
    dismissed : mapping of str to float
        Effects not worth a fit: the share of the squared error that a first look found them to explain.
    lookalikes : mapping of str to tuple of str
        Per chosen effect, those that explain the same as well: the recordings can't tell them apart. Empty where the
        chosen ones leave too much to be named.
    unnamed : UnnamedLaw or None
        The best law without a name for what the re-tuned nominal leaves, where it counts.
    remaining : UnnamedLaw or None
        The best one for what the chosen effects leave, where it counts.
    beyond : LineBeyond or None
        The nominal line beyond its tolerances, where these hold it back.
    hunts : sequence of Hunt
        The search for laws without a name in what the re-tuned nominal leaves, as far as it went: to locate goes on
        from there.
    unfinished : bool
        True where no further effect was tried: the steps of the integration have a part in what is left.
    """

    retuned: FitResult
    chosen: Effects
    result: FitResult
    accepted: Mapping[str, Trial]
    trials: Mapping[str, Trial]
    dismissed: Mapping[str, float]
    lookalikes: Mapping[str, tuple[str, ...]]
    unnamed: UnnamedLaw | None
    remaining: UnnamedLaw | None
    beyond: LineBeyond | None = None
    hunts: Sequence[Hunt] = ()
    unfinished: bool = False


@dataclass(frozen=True, slots=True)
class Survey:
    """A search for laws without a name in what a fit leaves: a first look, or `located`.

    Attributes
    ----------
    law : UnnamedLaw or None
        The best one, if it is beyond chance and visible.
    """

    hunts: Sequence[Hunt]
    law: UnnamedLaw | None


def survey(result: FitResult) -> Survey:
    """Look for laws without a name in what a fit leaves."""
    view = scene(result, noise_floor(result.problem.records))
    hunts = hunts_of(view)
    return Survey(hunts, _counting(best_of(judged(view, hunts)), result))


def located(result: FitResult, begun: Survey) -> Survey:
    """Return a survey of what a fit leaves with its search gone to the end: what simulates best, and where."""
    view = scene(result, noise_floor(result.problem.records))
    hunts = hunts_of(view, ROUNDS, begun.hunts)
    return Survey(hunts, _counting(best_of(judged(view, hunts)), result))


def _counting(law: UnnamedLaw | None, result: FitResult) -> UnnamedLaw | None:
    """Return a law if it is beyond chance and visible."""
    if law is None or law.gain.delta_bic < VERY_STRONG or law.gain.p_value > SIGNIFICANT:
        return None
    return law if result.rms >= VISIBLE * law.rms else None
