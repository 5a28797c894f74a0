"""What a selection hands over, with everything that a test does not care about left empty."""

from __future__ import annotations

from collections.abc import Mapping

from estimator.diagnosis.beyond import LineBeyond
from estimator.diagnosis.hypotheses import NOTHING, Effects
from estimator.diagnosis.selection import Selection
from estimator.diagnosis.trial import Trial
from estimator.diagnosis.unnamed import UnnamedLaw
from estimator.physics.fit import FitResult


def outcome(
    retuned: FitResult,
    chosen: Effects = NOTHING,
    result: FitResult | None = None,
    *,
    trials: Mapping[str, Trial] | None = None,
    dismissed: Mapping[str, float] | None = None,
    unnamed: UnnamedLaw | None = None,
    remaining: UnnamedLaw | None = None,
    beyond: LineBeyond | None = None,
) -> Selection:
    """Build a selection; every trial given is of a chosen effect."""
    tried = trials or {}
    return Selection(
        retuned=retuned,
        chosen=chosen,
        result=result or retuned,
        accepted=tried,
        trials=tried,
        dismissed=dismissed or {},
        lookalikes={},
        unnamed=unnamed,
        remaining=remaining,
        beyond=beyond,
    )
