"""``python -m hil.proof.worlds --set SET --seeds A..B --out DIR``: how often a diagnosis of simulated worlds is right.

Sets: ``clean`` (one effect of the catalogue by itself, in turn, and nothing every ninth seed), ``dirty`` (one strong
effect among small imperfections and coloured disturbances), ``quiet`` (the same with nothing strong), ``outside`` (one
effect that the catalogue has no entry for: every name is false). Cases come from the truth simulator. ``DIR/SET.jsonl``
has a line per case; called again, it continues where it was interrupted. The table that it prints counts the cases in
which what is strong was named, and the names that are not there.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

from estimator.diagnosis.diagnose import BUDGET_S, diagnose
from estimator.errors import EstimatorError
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record
from hil.config.model_file import read_model_for_recordings
from hil.proof.campaign.kinds import parse_seeds
from hil.proof.make_case import write_shown
from hil.proof.truth.bus import NOMINAL_TOLERANCE
from hil.proof.truth.case import Case, make_case
from hil.proof.truth.dirty import Known, make_dirty
from hil.proof.truth.hidden import same_recording
from hil.proof.truth.specimen import EFFECTS
from hil.recording import read_records
from hil.report.diagnosis_json import diagnosis_json

NOTHING = "none"
SURE = 0.9
"""Probability from which an effect is counted as believed."""

KINDS = [name for name, effect in EFFECTS.items() if effect.catalogued and name != NOTHING]
OUTSIDE = [name for name, effect in EFFECTS.items() if not effect.catalogued]
STRONG = [name for name in KINDS if EFFECTS[name].corrupt is same_recording]
"""Effects that can be the strong one of a dirty world: what happens to a recording alone is recognised by itself."""

Row = dict[str, Any]


def knows(seed: int) -> Known:
    """Return what the model file of a dirty case knows of its imperfections; each in turn."""
    return list(Known)[seed % len(Known)]


def case_of(which: str, seed: int) -> tuple[Case, dict[str, dict[str, float]], str]:
    """Return a case of a set, what its model file knows beyond the line, and what is strong in it."""
    if which == "clean":
        strong = NOTHING if seed % 9 == 0 else KINDS[seed % len(KINDS)]
        return make_case(strong, seed), {}, strong
    if which == "outside":
        return make_case(OUTSIDE[seed % len(OUTSIDE)], seed), {}, OUTSIDE[seed % len(OUTSIDE)]
    strong = NOTHING if which == "quiet" else STRONG[seed % len(STRONG)]
    return *make_dirty(strong, seed, knows(seed)), strong


def shown_case(
    which: str, seed: int, at_the_load: bool = False
) -> tuple[Sequence[Record], DrivelineModel, Case, dict[str, dict[str, float]], str]:
    """Return recordings and model of a case as a tool gets them, the case, what its model knows, what is strong."""
    case, known, strong = case_of(which, seed)
    tolerance = NOMINAL_TOLERANCE if knows(seed) is Known.OFF else 0.0
    with tempfile.TemporaryDirectory(prefix="hil-case-") as place:
        shown = Path(place)
        write_shown(case, shown, at_the_load)
        with (shown / "model.toml").open("a", encoding="utf-8") as model:
            model.write("".join(_stated(name, sizes, tolerance) for name, sizes in known.items()))
        file = read_model_for_recordings(shown / "model.toml")
        records = read_records(sorted(shown.glob("run_*.csv")), file.signals, file.on_bench)
    return records, file.model, case, known, strong


def answered(which: str, seed: int, budget_s: float = BUDGET_S, at_the_load: bool = False) -> Row:
    """Return the row of a case: what is there, what was named, and the time by the clock and of the processors."""
    records, model, case, known, strong = shown_case(which, seed, at_the_load)
    hidden = [name for name in case.specimen.sizes if name != NOTHING and name not in known]
    row: Row = {"set": which, "seed": seed, "outputs": 1 + at_the_load, "strong": strong, "hidden": hidden}
    began, worked = time.perf_counter(), time.process_time()
    try:
        answer = diagnosis_json(diagnose(records, model, budget_s=budget_s))
    except EstimatorError as error:
        return row | {"verdict": "refused", "named": [], "false": [], "fault": str(error)}
    claims = {effect["name"]: {effect["name"], *effect["indistinguishable_from"]} for effect in answer["effects"]}
    known_names = set(known)  # their sizes may be off: naming one again is no invention
    return row | {
        "verdict": answer["verdict"],
        "named": list(claims),
        "strong_named": any(strong in claim for claim in claims.values()),
        "false": [name for name, claim in claims.items() if not claim & ({*hidden} | known_names)],
        "probability": {effect["name"]: effect["probability"] for effect in answer["effects"]},
        "alike": {name: sorted(claim - {name}) for name, claim in claims.items()},
        "untestable": [each["name"] for each in answer["untestable"]],
        "traces": [trace["name"] for trace in answer["traces"]],
        "time_s": round(time.perf_counter() - began, 2),
        "cpu_s": round(time.process_time() - worked, 2),
    }


def _stated(name: str, sizes: dict[str, float], tolerance: float) -> str:
    """Return a table of a model file for what it knows; without a tolerance it is held."""
    trusted = f", tolerance = {tolerance}" if tolerance else ""
    lines = [f"{key} = {{ value = {value:.6g}{trusted} }}" for key, value in sizes.items()]
    return "\n".join([f"\n[effects.{name}]", *lines, ""])


def table(rows: Sequence[Row]) -> str:
    """Return the results as a table in Markdown, a line for each set and number of outputs.

    It says how many of the names given 0.9 or more are there, how many names others resemble, and how many effects of
    the catalogue could not be tested.
    """
    head = ["set, outputs", "cases", "strong named", "names", "false names", "no false name", "of given 0.9, there"]
    head += ["names like another", "untestable", "median, most [s]", "CPU median, most [s]"]
    lines = [f"| {' | '.join(head)} |", f"|{' --- |' * len(head)}"]
    for which, outputs in sorted({(row["set"], row.get("outputs", 1)) for row in rows}):
        mine = [row for row in rows if (row["set"], row.get("outputs", 1)) == (which, outputs)]
        strong = [row for row in mine if row["strong"] not in (NOTHING, *OUTSIDE)]
        times, worked = (sorted(row.get(key, 0.0) for row in mine) for key in ("time_s", "cpu_s"))
        names, false, untestable = (
            sum(len(row.get(key, ())) for row in mine) for key in ("named", "false", "untestable")
        )
        alike = sum(bool(others) for row in mine for others in row.get("alike", {}).values())
        sure = [
            (row, name) for row in mine for name, p in row.get("probability", {}).items() if p is not None and p >= SURE
        ]
        lines.append(
            f"| {which}, {outputs} | {len(mine)} | "
            f"{sum(row.get('strong_named', False) for row in strong)} of {len(strong)} | "
            f"{names} | {false} | {sum(not row['false'] for row in mine)} | "
            f"{sum(name not in row['false'] for row, name in sure)} of {len(sure)} | {alike} | {untestable} | "
            f"{times[len(times) // 2]:.1f}, {times[-1]:.1f} | {worked[len(worked) // 2]:.1f}, {worked[-1]:.1f} |"
        )
    return "\n".join(lines) + "\n"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m hil.proof.worlds", description="Diagnose simulated worlds and count what is right."
    )
    parser.add_argument("--set", required=True, choices=["clean", "dirty", "quiet", "outside"], dest="which")
    parser.add_argument("--seeds", required=True, help="A..B, both included")
    parser.add_argument("--at-the-load", action="store_true", help="each also with the load's speed as an output")
    parser.add_argument("--budget-s", type=float, default=BUDGET_S, help="of a diagnosis; more on a busy machine")
    parser.add_argument("--out", required=True, type=Path, help="folder for the results")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or continue with a set; return the exit status."""
    options = _parser().parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / f"{options.which}.jsonl"
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []
    done = {(row["seed"], row.get("outputs", 1)) for row in rows}
    for seed, at_the_load in product(parse_seeds(options.seeds), (False, True) if options.at_the_load else (False,)):
        if (seed, 1 + at_the_load) not in done:
            row = answered(options.which, seed, options.budget_s, at_the_load)
            rows.append(row)
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row, allow_nan=False) + "\n")
            sys.stdout.write(f"{seed} {row['strong']}: {row['verdict']} {row['named']} {row['false']}\n")
            sys.stdout.flush()
    sys.stdout.write(table(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
