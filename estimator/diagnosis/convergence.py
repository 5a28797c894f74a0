"""Fits that did not come to an end: said, and no explanation is built on one."""

from __future__ import annotations

from estimator.diagnosis.selection import Selection
from estimator.physics.catalogue import EFFECTS


def unconverged(selection: Selection) -> tuple[str, ...]:
    """Return a sentence for each fit of a verdict that did not converge; none where all did."""
    said = []
    if not selection.retuned.converged:
        said.append(_sentence("the re-tuned nominal model", "its error is an upper bound"))
    if selection.chosen and not selection.result.converged:
        titles = " and ".join(EFFECTS[name].title for name in sorted(selection.chosen))
        said.append(_sentence(f"the model with {titles}", "its values are not final"))
    return tuple(said)


def _sentence(what: str, so: str) -> str:
    return (
        f"The fit of {what} did not converge: {so}, and no explanation is built on it. Check that the nominal values "
        "are near the line's, narrow the tolerances, or record what excites more."
    )
