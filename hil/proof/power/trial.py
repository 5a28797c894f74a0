"""The rows of a power study: how far a size is from none, and whether the public command found it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hil.proof.campaign.case import run_made
from hil.proof.campaign.kinds import Group, Kind
from hil.proof.campaign.score import ALIKE, score
from hil.proof.judge import Outcome
from hil.proof.power.bound import Yardstick
from hil.proof.power.case import trial_case
from hil.proof.power.sizes import scale_of
from hil.proof.truth.specimen import draw_specimen

FOUND = {Outcome.RIGHT.name.lower(), ALIKE, Outcome.FALSE_CLAIM.name.lower()}
"""Outcomes in which the effect, or one declared to be the same, was named."""

LEAST_MULTIPLE = 1e-3
"""A trial's noise is numbered by its multiple in thousandths: the same whatever other multiples a study has."""


@dataclass(frozen=True, slots=True)
class Study:
    """What holds for all trials of a study.

    Attributes
    ----------
    alpha : float
        Level of the best test.
    multiples : tuple of float
        Sizes to try, over the bound of who has the recordings alone.
    samples : int
        Length of each recording.
    """

    alpha: float
    multiples: tuple[float, ...]
    samples: int


def measure(study: Study, effect: str, seed: int) -> dict[str, Any]:
    """Return the row of one bus and effect in ``bounds.jsonl``: the bounds, and the distances of all sizes to try."""
    yardstick = Yardstick(draw_specimen(effect, seed), study.samples)
    bound = yardstick.bound(study.alpha)
    distances = {f"{m:g}": asdict(yardstick.distance(m * bound.recorded)) for m in study.multiples}
    given = {"alpha": study.alpha, "samples": study.samples, "unit": scale_of(effect).unit}
    return {"kind": effect, "seed": seed, "fault": None, **given, "bound": asdict(bound), "distances": distances}


def attempt(study: Study, bounds: Mapping[str, Any], multiple: float, out: Path, limit_s: float) -> dict[str, Any]:
    """Return the row of one trial in ``results.jsonl``.

    Parameters
    ----------
    study
        What holds for all trials.
    bounds
        The row of `measure`.
    multiple
        Size over the bound of who has the recordings alone.
    out
        Folder of the study; the case's files go to ``cases/EFFECT/SEED/MULTIPLE``.
    limit_s
        Time for the command [s].
    """
    effect, seed, size = bounds["kind"], bounds["seed"], multiple * bounds["bound"]["recorded"]
    case = trial_case(draw_specimen(effect, seed), size, round(multiple / LEAST_MULTIPLE), study.samples)
    truth, answer = run_made(case, out / "cases" / effect / str(seed) / f"{multiple:g}", limit_s)
    row = score(Kind(effect, Group.SINGLE, effect), seed, truth, answer)
    return {
        **row,
        "kind": kind_of(effect, multiple),
        "effect": effect,
        "multiple": multiple,
        "size": size,
        "over": {name: size / least for name, least in bounds["bound"].items()},
        "distance": bounds["distances"][f"{multiple:g}"],
        "alpha": study.alpha,
        "samples": study.samples,
        "found": row["outcome"] in FOUND and row["verdict"] in ("explained", "partly_explained"),
    }


def kind_of(effect: str, multiple: float) -> str:
    """Return what a trial is called in the results: its effect and multiple."""
    return f"{effect} x {multiple:g}"


def made_otherwise(study: Study, rows: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """Return a row that was made at another level or length, None where there is none."""
    wanted = (study.alpha, study.samples)
    return next((row for row in rows if (row["alpha"], row["samples"]) != wanted), None)
