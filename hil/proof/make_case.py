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
from hil.proof.truth.bus import NOMINAL_ERROR, NOMINAL_TOLERANCE
from hil.proof.truth.case import Case, TruthRecording, make_case
from hil.proof.truth.specimen import EFFECTS, Specimen

SPEED_AT_THE_LOAD = """[signals]
outputs = [
    { kind = "speed", at = "motor", column = "speed_rad_s" },
    { kind = "speed", at = "load", column = "speed_load_rad_s" },
]
"""

_COLUMNS = (
    ("time_s", "%.6f"),
    ("torque_ref_nm", "%.3f"),
    ("torque_m1_nm", "%.3f"),
    ("torque_m2_nm", "%.3f"),
    ("speed_rad_s", "%.5f"),
    ("flags", "%d"),
)
_AT_THE_LOAD = ("speed_load_rad_s", "%.5f")


def model_toml(specimen: Specimen, at_the_load: bool = False) -> str:
    """Return the text of the model file; with the speed ``at_the_load`` as a second output where it is recorded."""
    lines = ['schema = "hil.model/1"', 'structure = "two_mass"', "", "[parameters]"]
    for name, value in specimen.nominal.items():
        lines.append(f"{name} = {{ value = {value:.6g}, tolerance = {NOMINAL_TOLERANCE} }}")
    text = "\n".join([*lines, "", "[geometry]", f"gear_ratio = {specimen.bus.gear_ratio}", ""])
    return f"{text}\n{SPEED_AT_THE_LOAD}" if at_the_load else text


def write_recording(path: Path, recording: TruthRecording, at_the_load: bool = False) -> None:
    """Write the columns a tool may see as CSV; ``flags`` only where the recorder has given any."""
    shown = (*_COLUMNS, _AT_THE_LOAD) if at_the_load else _COLUMNS
    columns = [(name, number) for name, number in shown if getattr(recording, name) is not None]
    np.savetxt(
        path,
        np.column_stack([getattr(recording, name) for name, _ in columns]),
        fmt=[number for _, number in columns],
        delimiter=",",
        header=",".join(name for name, _ in columns),
        comments="",
    )


def write_shown(case: Case, folder: Path, at_the_load: bool = False) -> None:
    """Write what the tool gets into a folder, which is made where it is missing.

    ``at_the_load`` where the speed of the load is recorded, too, and the model file names it as an output.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.toml").write_text(model_toml(case.specimen, at_the_load), encoding="utf-8")
    for number, recording in enumerate(case.recordings, start=1):
        write_recording(folder / f"run_{number}.csv", recording, at_the_load)


def write_sealed(case: Case, folder: Path) -> None:
    """Write what judges the tool into a folder, which is made where it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "truth.json").write_text(json.dumps(case.truth(), indent=1) + "\n", encoding="utf-8")
    for number, recording in enumerate(case.fresh, start=1):
        write_recording(folder / f"fresh_{number}.csv", recording)


def _share(text: str) -> float:
    """Read an option that is a share no larger than the nominal model's tolerance allows."""
    share = float(text)
    if not 0.0 <= share <= NOMINAL_ERROR:
        raise argparse.ArgumentTypeError(f"expected 0 to {NOMINAL_ERROR}, got {text}")
    return share


def main(arguments: Sequence[str] | None = None) -> int:
    """Make one case as files; return 0, or leave by SystemExit where the arguments are wrong."""
    parser = argparse.ArgumentParser(
        prog="python -m hil.proof.make_case", description="Make one case with something hidden, as files."
    )
    parser.add_argument("--effect", required=True, help=f"{', '.join(EFFECTS)}; several joined by +")
    parser.add_argument("--seed", required=True, type=int, help="what everything is drawn from, 0 or more")
    parser.add_argument("--out", required=True, type=Path, help="folder that gets case/ and sealed/")
    parser.add_argument(
        "--nominal-error",
        type=_share,
        default=NOMINAL_ERROR,
        help="share by which each value of the nominal model is off at most (default: %(default)s)",
    )
    options = parser.parse_args(arguments)
    try:
        case = make_case(options.effect, options.seed, options.nominal_error)
    except UsageError as error:
        parser.error(str(error))
    write_shown(case, options.out / "case")
    write_sealed(case, options.out / "sealed")
    sys.stdout.write(f"{options.out}/case {options.out}/sealed\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
