"""``hil prove run``: every case answered by the public command, which sees that case and nothing else.

::

    DIR/verdicts/case_001/       diagnosis.json, augmented.toml, report.html; or fault.txt: why there is none
    DIR/verdicts/verdicts.json   a digest of each file, and of the case it answers
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil.proof.command import CommandFailed, run_hil
from hil.proof.own_folder import replace_own
from hil.proof.prove.each import each
from hil.proof.prove.make import Progress
from hil.proof.prove.manifest import (
    CASES,
    VERDICTS,
    VERDICTS_LIST,
    Shown,
    digest_of,
    digests_of,
    place_in,
    read_commitments,
    read_list,
    require_unchanged,
    write_list,
)

LIMIT_S = 900.0
"""Time one command may take before its case counts as failed."""

FAULT = "fault.txt"


def answer(folder: Path, jobs: int, progress: Progress, limit_s: float = LIMIT_S) -> str:
    """Answer every case of a set that has no answer yet; return one digest of all answers.

    Raises
    ------
    UsageError, SealBroken
        If the folder has no set, a case has changed since it was made, or its answer would take the place of something
        else.
    """
    cases = read_commitments(folder)
    answered: dict[str, Any] = _answered(folder, cases)
    waiting = [name for name in cases if name not in answered]
    for name, entry in each(lambda name: _answer_one(folder, name, cases[name], limit_s), waiting, jobs):
        answered[name] = entry
        write_list(folder / VERDICTS_LIST, dict(sorted(answered.items())))
        progress(f"{name} answered", len(answered), len(cases))
    return digest_of(answered)


def _answered(folder: Path, cases: Mapping[str, Shown]) -> dict[str, Any]:
    """Return the answers from an earlier run, to just these cases, that are still in their folders."""
    if not (folder / VERDICTS_LIST).exists():
        return {}
    listed = read_list(folder / VERDICTS_LIST, "remove the folder verdicts to begin anew")
    known = {name: digest_of(dict(shown.files)) for name, shown in cases.items()}
    return {
        name: entry
        for name, entry in listed.items()
        if entry.get("case") == known.get(name) and (folder / VERDICTS / name).is_dir()
    }


def _answer_one(folder: Path, name: str, shown: Shown, limit_s: float) -> dict[str, Any]:
    case, out = place_in(folder, CASES, name), place_in(folder, VERDICTS, name)
    require_unchanged(case, shown.files)
    began = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="hil-case-") as neutral:
        place = Path(neutral) / "case"
        place.mkdir()
        for file in shown.files:
            shutil.copyfile(case / file, place / file)
        (Path(neutral) / "out").mkdir()
        try:
            runs = sorted(file for file in shown.files if file.endswith(".csv"))
            run_hil(["diagnose", *runs, "--model", "model.toml", "--out", "../out"], place, limit_s)
        except CommandFailed as failure:
            (Path(neutral) / "out" / FAULT).write_text(f"{failure}\n", encoding="utf-8")
        took_s = time.perf_counter() - began
        built = Path(neutral) / "out"
        files = digests_of(built, sorted(path.name for path in built.iterdir()))
        replace_own(out, built)
    return {"case": digest_of(dict(shown.files)), "files": files, "diagnose_s": round(took_s, 2)}
