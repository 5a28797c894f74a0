"""``python -m tests.campaigns.worlds --forms FORMS --seeds A..B --out DIR``: verdicts on worlds of several forms.

Each world is answered by the public ``diagnose``, and what it names is compared with what is there. FORMS: names of
`ALL`, ``calibrate``, ``judge`` or ``all``, joined by commas:

- ``clean`` (one effect of the catalogue by itself, in turn, and nothing every ninth seed), ``dirty`` (one strong
  effect among small imperfections and coloured disturbances), ``quiet`` (the same with nothing strong) and ``outside``
  (what the catalogue has no entry for: every name is false) come from the proof's truth simulator;
- the forms of `tests.campaigns.forms` have laws of other forms, one each;
- ``engine_outside`` (`tests.campaigns.engine_outside`) has laws that the catalogue has no entry for. A row of it, or of
  ``outside``, has the error on recordings that no fit has seen, re-tuned and augmented, and the place;
- ``engine`` is a rigid-body engine (`tests.campaigns.engine`), left out where MuJoCo is not installed.

``DIR/worlds.jsonl`` has a line for each world; called again, it continues where it was interrupted. The tables count
the worlds in which what is strong was named, the names that are not there, and, in bins of the stated probability, how
many of the names are there.
"""

import argparse
import importlib.util
import json
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.result import Diagnosis
from estimator.errors import EstimatorError
from estimator.physics.free_run import free_run
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record
from hil.config.model_file import read_model_for_recordings
from hil.proof.make_case import write_shown
from hil.proof.truth.bus import NOMINAL_TOLERANCE
from hil.proof.truth.case import Case, TruthRecording, make_case
from hil.proof.truth.hidden import same_recording
from hil.proof.truth.specimen import EFFECTS, NOTHING
from hil.proof.work import work_on
from hil.recording import read_records
from hil.report.diagnosis_json import diagnosis_json
from tests.campaigns.dirty import Known, make_dirty
from tests.campaigns.engine import ROLE as ENGINE_ROLE, make_engine
from tests.campaigns.engine_outside import LAWS, PLACES, ROLE as OUTSIDE_ROLE, make_outside
from tests.campaigns.forms import FORMS, Role, make_form
from tests.estimator.diagnosis.sentences import contradictions

KINDS = [name for name, effect in EFFECTS.items() if effect.catalogued and name != NOTHING]
OUTSIDE = [name for name, effect in EFFECTS.items() if not effect.catalogued]
STRONG = [name for name in KINDS if EFFECTS[name].corrupt is same_recording]
"""Effects that can be the strong one of a dirty world: what happens to a recording alone is recognised by itself."""

ENGINE, ENGINE_OUTSIDE = "engine", "engine_outside"
ALL: Mapping[str, Role] = {
    "clean": Role.CALIBRATE,
    "dirty": Role.CALIBRATE,
    "quiet": Role.CALIBRATE,
    "outside": Role.JUDGE,
    **{name: form.role for name, form in FORMS.items()},
    ENGINE_OUTSIDE: OUTSIDE_ROLE,
    ENGINE: ENGINE_ROLE,
}
"""Every form of world, and what it is for. What thresholds are fitted on does not judge them."""

UNNAMED = ("outside", ENGINE_OUTSIDE)
"""Forms whose laws have no name: judged by place, and on recordings that no fit has seen."""

BINS = (0.0, 0.5, 0.8, 0.9, 0.99, 0.999, 1.0)
"""Bins of the stated probability; the last one holds 1."""

LARGER = 1.01  # error over the re-tuned model's from which on it is larger: below, initial states are found otherwise

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class World:
    """A world as a tool gets it, and what is true of it: what its model file knows, and what is strong in it."""

    records: Sequence[Record]
    model: DrivelineModel
    case: Case
    known: Mapping[str, Mapping[str, float]]
    strong: str


def knows(seed: int) -> Known:
    """Return what the model file of a dirty world knows of its imperfections; each in turn."""
    return list(Known)[seed % len(Known)]


def _case(form: str, seed: int) -> tuple[Case, dict[str, dict[str, float]], str]:
    if form == "clean":
        strong = NOTHING if seed % 9 == 0 else KINDS[seed % len(KINDS)]
        return make_case(strong, seed), {}, strong
    if form == "outside":
        return make_case(OUTSIDE[seed % len(OUTSIDE)], seed), {}, OUTSIDE[seed % len(OUTSIDE)]
    if form == ENGINE_OUTSIDE:
        case = make_outside(seed)
        return case, {}, case.specimen.effect
    if form in ("dirty", "quiet"):
        strong = NOTHING if form == "quiet" else STRONG[seed % len(STRONG)]
        return *make_dirty(strong, seed, knows(seed)), strong
    case = make_engine(seed) if form == ENGINE else make_form(form, seed)
    return case, {}, case.specimen.effect


def world_of(form: str, seed: int, at_the_load: bool = False) -> World:
    """Return a world, through the files that a tool gets."""
    case, known, strong = _case(form, seed)
    tolerance = NOMINAL_TOLERANCE if knows(seed) is Known.OFF else 0.0
    with tempfile.TemporaryDirectory(prefix="hil-case-") as place:
        shown = Path(place)
        write_shown(case, shown, at_the_load)
        with (shown / "model.toml").open("a", encoding="utf-8") as model:
            model.write("".join(_stated(name, sizes, tolerance) for name, sizes in known.items()))
        file = read_model_for_recordings(shown / "model.toml")
        records = read_records(sorted(shown.glob("run_*.csv")), file.signals, file.on_bench)
    return World(records, file.model, case, known, strong)


def _stated(name: str, sizes: Mapping[str, float], tolerance: float) -> str:
    """Return a table of a model file for what it knows; without a tolerance it is held."""
    trusted = f", tolerance = {tolerance}" if tolerance else ""
    lines = [f"{key} = {{ value = {value:.6g}{trusted} }}" for key, value in sizes.items()]
    return "\n".join([f"\n[effects.{name}]", *lines, ""])


def answered(form: str, seed: int, at_the_load: bool = False, **options: Any) -> Row:
    """Return the row of a world: what is there, what was named, and the time of clock and processors.

    ``options`` go to ``diagnose``.
    """
    world = world_of(form, seed, at_the_load)
    hidden = {name for name in world.case.specimen.sizes if name != NOTHING}
    row: Row = {
        "form": form,
        "seed": seed,
        "outputs": 1 + at_the_load,
        "strong": world.strong,
        "hidden": sorted(hidden - set(world.known)),
    }
    began, worked = time.perf_counter(), time.process_time()
    try:
        diagnosis = diagnose(world.records, world.model, **options)
    except EstimatorError as error:
        return row | {"verdict": "refused", "names": [], "fault": str(error)}
    answer = diagnosis_json(diagnosis)
    if form in UNNAMED:
        row |= on_fresh(world, diagnosis)
    return row | {
        "verdict": answer["verdict"],
        "names": [_name(effect, hidden, world.strong) for effect in answer["effects"]],
        "traces": [trace["name"] for trace in answer["traces"]],
        "refinements": [each["name"] for each in answer["refinements"]],
        "fit": answer["fit"],
        "contradictions": contradictions(diagnosis),
        "time_s": round(time.perf_counter() - began, 2),
        "cpu_s": round(time.process_time() - worked, 2),
    }


def on_fresh(world: World, diagnosis: Diagnosis) -> Row:
    """Return what a world outside of the catalogue is judged by: place, table, and errors on fresh recordings."""
    shown = {name: each for name, each in world.case.named_recordings().items() if name.startswith("fresh")}
    fresh = [_read(name, each, world.records[0]) for name, each in shown.items()]
    values = {name: each.value for name, each in diagnosis.parameters.items()}
    retuned = replace(
        world.model,
        parameters={name: replace(p, value=values.get(name, p.value)) for name, p in world.model.parameters.items()},
    )
    table = diagnosis.table
    found = diagnosis.mismatch.element if table is None else table.element
    places = PLACES[world.strong] if world.strong in PLACES else (EFFECTS[world.strong].place.value,)
    return {
        "place": None if table is None else table.place,
        "place_is_right": found is not None and found.value in places,
        "fresh_retuned": _fresh_rms(retuned, fresh),
        "fresh_augmented": _fresh_rms(diagnosis.augmented, fresh),
        "unseen": None if table is None else [table.rms_before, table.rms_after],
    }


def _read(name: str, recording: TruthRecording, like: Record) -> Record:
    torque = np.column_stack([recording.torque_m1_nm, recording.torque_m2_nm])
    okay = np.ones(recording.time_s.size, dtype=np.bool_)
    return replace(
        like, name=name, time_s=recording.time_s, torque_nm=torque, output=recording.speed_rad_s, okay=okay,
        torque_okay=None, offset_s=None, reference_nm=None, load_nm=None,
    )  # fmt: skip


def _fresh_rms(model: DrivelineModel, fresh: Sequence[Record]) -> float:
    return float(np.sqrt(np.mean([free_run(model, record).rms ** 2 for record in fresh])))


def _name(effect: Mapping[str, Any], hidden: set[str], strong: str) -> Row:
    """Return a name with its probability and how much it is needed, in the middle and at least.

    It is there if it, or what it says it resembles, is in the world. What the model file knows is there, too: its sizes
    may be off, and to name it again is no invention.
    """
    claim = {effect["name"], *effect["indistinguishable_from"]}
    return {
        "name": effect["name"],
        "probability": effect["probability"],
        "necessity": effect["necessity"],
        "least": effect["least_necessity"],
        "alike": sorted(claim - {effect["name"]}),
        "is_there": bool(claim & hidden),
        "is_strong": strong in claim,
    }


def main_named(row: Row) -> bool:
    """Whether what is strong in a world was named."""
    return any(name["is_strong"] for name in row["names"])


def table(rows: Sequence[Row]) -> str:
    """Return the results as a table in Markdown: a line for each form, one for each role, one for all."""
    head = ["form, outputs", "worlds", "main named", "names", "false names", "no false name", "no verdict"]
    head += ["of stated 0.9, there", "reports that contradict their numbers", "CPU median, most [s]"]
    groups = []
    for form, outputs in product(ALL, (1, 2)):
        groups.append((f"{form}, {outputs}", [row for row in rows if (row["form"], row["outputs"]) == (form, outputs)]))
    groups += [(f"**{role.value}**", [row for row in rows if ALL[row["form"]] is role]) for role in Role]
    lines = [_cells(title, group) for title, group in groups if group]
    return "\n".join([f"| {' | '.join(head)} |", f"|{' --- |' * len(head)}", *lines]) + "\n"


def _cells(title: str, rows: Sequence[Row]) -> str:
    strong = [row for row in rows if row["strong"] not in (NOTHING, *OUTSIDE, *LAWS)]
    names = [name for row in rows for name in row["names"]]
    false = sum(not name["is_there"] for name in names)
    clean = sum(all(name["is_there"] for name in row["names"]) for row in rows)
    sure = [name["is_there"] for name in names if name["probability"] is not None and name["probability"] >= 0.9]
    worked = sorted(row.get("cpu_s", 0.0) for row in rows)
    undecided = sum(row["verdict"] in ("unexplained", "refused") for row in rows)
    cells = [title, len(rows), f"{sum(map(main_named, strong))} of {len(strong)}", len(names), false, clean, undecided]
    read = [row["contradictions"] for row in rows if "contradictions" in row]
    cells += [
        f"{sum(sure)} of {len(sure)}",
        f"{sum(map(bool, read))} of {len(read)}",
        f"{worked[len(worked) // 2]:.1f}, {worked[-1]:.1f}",
    ]
    return f"| {' | '.join(map(str, cells))} |"


def unnamed(rows: Sequence[Row]) -> str:
    """Return how many augmented models are better on recordings that no fit has seen, in Markdown."""
    judged = [row for row in rows if "fresh_retuned" in row or (row["form"] in UNNAMED and row["verdict"] == "refused")]
    over = [row["fresh_augmented"] / row["fresh_retuned"] for row in judged if "fresh_retuned" in row]
    counts = {
        "worlds of laws without a name": len(judged),
        "error on fresh recordings at most half of the re-tuned": sum(each <= 0.5 for each in over),
        "larger": sum(each > LARGER for each in over),
        "place right": sum(row.get("place_is_right", False) for row in judged),
    }
    return f"| {' | '.join(counts)} |\n|{' --- |' * len(counts)}\n| {' | '.join(map(str, counts.values()))} |\n"


def reliability(rows: Sequence[Row]) -> str:
    """Return the reliability curve as a table in Markdown: how many names are there, by stated probability and role."""
    groups = {role.value: [row for row in rows if ALL[row["form"]] is role] for role in Role}
    lines = [f"| stated probability | {' | '.join(groups)} |", f"|{' --- |' * (1 + len(groups))}"]
    for low, high in pairwise(BINS):
        cells = []
        for group in groups.values():
            names = [name for row in group for name in row["names"] if name["probability"] is not None]
            inside = [n for n in names if low <= n["probability"] < high or n["probability"] == high == BINS[-1]]
            stated = sum(n["probability"] for n in inside) / len(inside) if inside else 0.0
            there = f"{sum(n['is_there'] for n in inside)} of {len(inside)} there"
            cells.append(f"{there}, stated {stated:.3g}" if inside else "")
        lines.append(f"| {low:g} to {high:g} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def parse_seeds(text: str) -> range:
    """Return the seeds of ``A..B``, both included, or of a single number."""
    first, sign, last = text.partition("..")
    try:
        seeds = range(int(first), int(last if sign else first) + 1)
    except ValueError:
        seeds = range(0)
    if not seeds or seeds[0] < 0:
        raise argparse.ArgumentTypeError(f"expected A..B with 0 <= A <= B, or one number, got {text!r}")
    return seeds


def parse_forms(text: str) -> list[str]:
    """Return the forms of a list of names and roles."""
    found: list[str] = []
    for word in text.split(","):
        named = [name for name, role in ALL.items() if word in ("all", name, role.value)]
        if not named:
            raise argparse.ArgumentTypeError(f"expected all, calibrate, judge or of {', '.join(ALL)}, got {word!r}")
        found += named
    return list(dict.fromkeys(found))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.campaigns.worlds", description="Diagnose worlds of several forms and count what is true."
    )
    parser.add_argument("--forms", required=True, type=parse_forms, help="names, calibrate, judge or all; with commas")
    parser.add_argument("--seeds", required=True, type=parse_seeds, help="A..B, both included")
    parser.add_argument("--at-the-load", action="store_true", help="each also with the load's speed as an output")
    parser.add_argument("--budget-s", type=float, help="limit of time of a diagnosis (default: the tool's own)")
    parser.add_argument("--effort", help="effort of a diagnosis, where the tool has one")
    parser.add_argument("--out", required=True, type=Path, help="folder for the results")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or continue; return the exit status."""
    options = _parser().parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    if ENGINE in options.forms and importlib.util.find_spec("mujoco") is None:
        sys.stdout.write("engine: left out, MuJoCo is not installed: pip install mujoco\n")
        options.forms.remove(ENGINE)
    outputs = (1, 2) if options.at_the_load else (1,)
    worlds = ((form, seed, count) for seed, form, count in product(options.seeds, options.forms, outputs))
    wanted = {_key(*world): world for world in worlds}
    given = {name: value for name in ("budget_s", "effort") if (value := getattr(options, name)) is not None}

    def work(name: str) -> Row:
        form, seed, count = wanted[name]
        row = answered(form, seed, count == 2, **given)
        found = [each["name"] + ("" if each["is_there"] else " (false)") for each in row["names"]]
        sys.stdout.write(f"{name} {row['strong']}: {row['verdict']} {', '.join(found)}\n")
        sys.stdout.flush()
        return row

    rows = continued(options.out / "worlds.jsonl", list(wanted), work)
    sys.stdout.write(f"{table(rows)}\n{unnamed(rows)}\n{reliability(rows)}")
    return 0


def _key(form: str, seed: int, outputs: int) -> str:
    return f"{form} {seed} {outputs}"


def continued(path: Path, names: Sequence[str], work: Callable[[str], Row]) -> list[Row]:
    """Return the row of each name: from a file of JSON lines, to which those are added that are not there yet."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    known = {entry["name"]: entry["row"] for entry in map(json.loads, lines)}

    def kept(name: str) -> Row:
        row = work(name)
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"name": name, "row": row}, allow_nan=False) + "\n")
        return row

    return list(work_on(names, kept, known=known).values())


if __name__ == "__main__":
    sys.exit(main())
