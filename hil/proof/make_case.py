"""``python -m hil.proof.make_case --effect NAME --seed N --out DIR``: one case as files.

``DIR/case`` is what the tool gets (``model.toml``, ``run_1.csv`` ...), ``DIR/sealed`` what judges it
(``truth.json``, ``fresh_1.csv`` ...).
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hil.errors import UsageError
from hil.proof.nominal_file import model_toml
from hil.proof.truth.case import Case, TruthRecording, make_case
from hil.proof.truth.registry import EFFECTS

_COLUMNS = (
    ("time_s", "%.3f"),
    ("torque_ref_nm", "%.3f"),
    ("torque_m1_nm", "%.3f"),
    ("torque_m2_nm", "%.3f"),
    ("speed_rad_s", "%.5f"),
)


def write_recording(path: Path, recording: TruthRecording) -> None:
    """Write the columns a tool may see as CSV."""
    table = np.column_stack([getattr(recording, name) for name, _ in _COLUMNS])
    np.savetxt(
        path,
        table,
        fmt=[number for _, number in _COLUMNS],
        delimiter=",",
        header=",".join(name for name, _ in _COLUMNS),
        comments="",
    )


def write_case(case: Case, folder: Path) -> None:
    """Write ``case/`` and ``sealed/`` into a folder, which is made where it is missing."""
    shown, sealed = folder / "case", folder / "sealed"
    for room in (shown, sealed):
        room.mkdir(parents=True, exist_ok=True)
    (shown / "model.toml").write_text(model_toml(case.specimen), encoding="utf-8")
    (sealed / "truth.json").write_text(json.dumps(case.truth(), indent=1) + "\n", encoding="utf-8")
    for number, recording in enumerate(case.recordings, start=1):
        write_recording(shown / f"run_{number}.csv", recording)
    for number, recording in enumerate(case.fresh, start=1):
        write_recording(sealed / f"fresh_{number}.csv", recording)


def main(arguments: Sequence[str] | None = None) -> int:
    """Make one case; return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m hil.proof.make_case", description="Make one case with something hidden, as files."
    )
    parser.add_argument("--effect", required=True, help=f"{', '.join(EFFECTS)}; several joined by +")
    parser.add_argument("--seed", required=True, type=int, help="what everything is drawn from, 0 or more")
    parser.add_argument("--out", required=True, type=Path, help="folder that gets case/ and sealed/")
    options = parser.parse_args(arguments)
    try:
        case = make_case(options.effect, options.seed)
    except UsageError as error:
        parser.error(str(error))
    write_case(case, options.out)
    sys.stdout.write(f"{options.out}/case {options.out}/sealed\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
