"""``hil prove make``: cases drawn, recorded and sealed.

::

    DIR/cases/commitments.json   a commitment to each truth, a digest of each file that is shown
    DIR/cases/case_001/          model.toml, run_1.csv ...: what the tool gets
    DIR/sealed/case_001.sealed   the truth and fresh recordings, encrypted
"""

from __future__ import annotations

import json
import tempfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

from hil.errors import UsageError
from hil.proof.make_case import write_recording, write_shown
from hil.proof.prove.draw import Drawn, draw
from hil.proof.prove.each import each
from hil.proof.prove.manifest import CASES, COMMITMENTS, SEALED, digests_of, write_list
from hil.proof.prove.vault import lock
from hil.proof.seal import seal
from hil.proof.truth.case import Case, make_case

Progress = Callable[[str, int, int], None]
"""Called with what has been done, how many of it, and how many there are in all."""


def make(folder: Path, cases: int, seed: int, key: bytes, jobs: int, progress: Progress) -> None:
    """Make and seal a set of cases; the folder appears when all of it is there.

    Parameters
    ----------
    folder
        Must not be there yet, or be empty.
    seed
        What everything is drawn from.
    key
        Of the sealed files.

    Raises
    ------
    UsageError
        If there is something in the folder already.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"{folder}: expected a folder that is not there yet or is empty. Choose another.")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".unfinished-") as workshop:
        built = Path(workshop) / "set"
        write_list(built / COMMITMENTS, _made(built, draw(cases, seed), key, jobs, progress))
        built.replace(folder)


def _made(folder: Path, drawn: list[Drawn], key: bytes, jobs: int, progress: Progress) -> dict[str, object]:
    (folder / SEALED).mkdir(parents=True)
    listed: dict[str, object] = {}
    for case, entry in each(lambda case: _make_one(folder, case, key), drawn, jobs):
        listed[case.name] = entry
        progress(f"{case.name} made", len(listed), len(drawn))
    return dict(sorted(listed.items()))


def _make_one(folder: Path, drawn: Drawn, key: bytes) -> dict[str, object]:
    case = make_case(drawn.kind.effect, drawn.seed, drawn.kind.nominal_error)
    shown = folder / CASES / drawn.name
    write_shown(case, shown)
    fresh = _fresh(case)
    truth = {"kind": drawn.kind.name, "seed": drawn.seed, "case": case.truth(), "fresh": fresh}
    sealed = seal(json.loads(json.dumps(truth)))
    content = zlib.compress(json.dumps(sealed.opened()).encode())
    (folder / SEALED / f"{drawn.name}.sealed").write_bytes(lock(key, drawn.name, content))
    return {
        "commitment": sealed.commitment,
        "files": digests_of(shown, sorted(path.name for path in shown.iterdir())),
    }


def _fresh(case: Case) -> Mapping[str, str]:
    """Return the fresh recordings as text, by file name."""
    with tempfile.TemporaryDirectory(prefix="hil-fresh-") as place:
        for number, recording in enumerate(case.fresh, start=1):
            write_recording(Path(place) / f"fresh_{number}.csv", recording)
        return {path.name: path.read_text(encoding="utf-8") for path in sorted(Path(place).iterdir())}
