"""One sealed rig, driven and diagnosed by the public command line alone, which only has CANopen and Modbus."""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path
from typing import Any

from hil.proof.campaign.case import Answer
from hil.proof.campaign.kinds import kind
from hil.proof.campaign.score import score
from hil.proof.command import CommandFailed, run_hil
from hil.proof.own_folder import replace_own
from hil.proof.seal import verify
from hil.proof.wire.concealed import Concealed
from hil.proof.wire.rig_text import rig_text
from hil.proof.wire.sealed_process import SealedProcess, sealed_process

EXPERIMENTS = ("cruise", "reversal", "tip")
KEPT = ("diagnosis.json", "augmented.toml", "report.html")

Row = dict[str, Any]


def drive(name: str, concealed: Concealed, seed: int, out: Path, limit_s: float) -> Row:
    """Drive one rig and judge what the tool makes of it.

    Parameters
    ----------
    seed
        What bus and sizes are drawn from.
    out
        Gets the recordings and the report, in a folder of the rig's name.
    limit_s
        Time for one command [s].

    Returns
    -------
    dict
        A row as a campaign's, with ``case`` (the rig's name), ``where`` and ``said`` (a refusal) next to.
    """
    arguments = ["--seed", str(seed), "--effect", concealed.effect]
    for fault in concealed.faults:
        arguments += ["--fault", fault]
    with tempfile.TemporaryDirectory(prefix="hil-rig-") as neutral:
        place = Path(neutral) / "rig"
        place.mkdir()
        with sealed_process(*arguments, "--model", str(place / "nominal.toml")) as sealed:
            (place / "rig.toml").write_text(rig_text(sealed), encoding="utf-8")
            answer = _work(place, limit_s)
            truth = _truth(sealed, concealed)
        replace_own(out / name, place)
    about = {"case": name, "where": concealed.where, "said": answer.fault or ""}
    if concealed.refused:
        return {**about, **_refusal(concealed, seed, answer)}
    return {**score(kind(str(truth["effect"])), seed, truth, answer), **about}


def _work(place: Path, limit_s: float) -> Answer:
    """Do what an engineer would do with a rig."""
    began = time.perf_counter()
    try:
        run_hil(["check", "rig.toml"], place, limit_s)
        for name in EXPERIMENTS:
            run_hil(["run", "rig.toml", name, "--pace", "fast", "--out", f"{name}.csv"], place, limit_s)
        recordings = [f"{name}.csv" for name in EXPERIMENTS]
        run_hil(["diagnose", *recordings, "--model", "nominal.toml", "--out", "."], place, limit_s)
    except CommandFailed as failure:
        return Answer(None, diagnose_s=time.perf_counter() - began, fault=str(failure))
    diagnosis = json.loads((place / "diagnosis.json").read_text(encoding="utf-8"))
    return Answer(diagnosis, diagnose_s=time.perf_counter() - began)


def _truth(sealed: SealedProcess, concealed: Concealed) -> dict[str, Any]:
    return {**verify(sealed.commitment, sealed.open()), "events": {}, **concealed.truth}


def _refusal(concealed: Concealed, seed: int, answer: Answer) -> Row:
    right = answer.fault is not None and concealed.refused in answer.fault
    return {
        "kind": concealed.refused,
        "seed": seed,
        "outcome": "right" if right else "failed" if answer.fault else "drove all the same",
        "success": right,
        "fault": None if right else answer.fault,
        "diagnose_s": round(answer.diagnose_s, 2),
        "fresh_over_floor": [],
    }
