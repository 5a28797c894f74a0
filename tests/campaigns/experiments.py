"""``python -m tests.campaigns.experiments --seeds A..B --out DIR``: designed experiments against a fixed program.

Each sealed rig conceals one effect that has a look-alike. ``hil solve`` drives what it designs, three experiments at
most; the fixed program is the demo's cruise, reversal and tip. Both verdicts are those of ``hil solve``: decided, or
open. Only then is the seal opened. ``DIR/experiments.jsonl`` has a line for each rig; called again, it continues.

The table counts what was decided, and right: every concealed effect named, nothing else, and without a look-alike.
The last line holds the promise of each designed experiment against what came: how often the design said it would tell,
and how often it was decided after it.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from hil.proof.command import CommandFailed, run_hil
from hil.proof.rigs import EXPERIMENTS, rig_text, sealed_process
from hil.proof.seal import verify
from tests.benchmarks.ratios import table
from tests.campaigns.worlds import parse_seeds

ALIKE = {
    "lag, delay or filter": ("actuator_lag", "transport_delay", "speed_filter"),
    "dry friction at motor or load": ("coulomb_friction_motor", "coulomb_friction_load"),
    "brake or grade": ("brake_drag", "road_grade"),
    "gap, hysteresis or softening": ("backlash", "shaft_hysteresis", "stiffness_nonlinearity"),
    "saturation or derating": ("torque_saturation", "torque_derating"),
    "gravity or imbalance": ("load_imbalance", "cardan_second_order"),
    "inertia at either end": ("generator_coupled", "inertia_change"),
}
"""Effects that many experiments can't distinguish, by what they have in common."""

EFFECTS = [(alike, effect) for alike, effects in ALIKE.items() for effect in effects]

MOMENTS_AFTER_S = 20.0
"""When moments count from [s]: some 20 s pass on the way to the first recording. A payload that has changed by then, or
a clutch that has closed, is in no recording."""

WAYS = ("designed", "fixed")
MOST_DRIVEN = 3
MOST_VEHICLE_S = 600.0
LIMIT_S = 3600.0

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Settled:
    """What one way came to on a rig."""

    decided: bool
    named: tuple[str, ...]
    alike: bool
    driven: list[Row]

    @classmethod
    def read(cls, folder: Path) -> "Settled":
        """Read the folder that ``hil solve`` leaves."""
        state = json.loads((folder / "solve.json").read_text(encoding="utf-8"))
        found = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))["effects"]
        alike = any(each["indistinguishable_from"] for each in found)
        return cls(state["end"] == "decided", tuple(sorted(each["name"] for each in found)), alike, state["driven"])

    def document(self, hidden: list[str]) -> Row:
        """Return the row's part, judged."""
        decided = self.decided and not self.alike and len(self.driven) <= MOST_DRIVEN
        return {
            "decided": decided,
            "right": decided and list(self.named) == hidden,
            "named": list(self.named),
            "experiments": [each["name"] for each in self.driven],
            "promised": [each["promised_probability"] for each in self.driven if each["promised_probability"]],
        }


def answered(seed: int, effort: str) -> Row:
    """Return the row of one rig: both ways on the same bus with the same effect."""
    alike, effect = EFFECTS[seed % len(EFFECTS)]
    with tempfile.TemporaryDirectory(prefix="hil-experiments-") as place:
        folder = Path(place)
        model = folder / "nominal.toml"
        solve = ["solve", "rig.toml", "--model", model.name, "--effort", effort, "--pace", "fast", "--yes"]
        drawn = ("--seed", str(seed), "--effect", effect, "--moments-after-s", str(MOMENTS_AFTER_S))
        with sealed_process(*drawn, "--model", str(model)) as sealed:
            (folder / "rig.toml").write_text(rig_text(sealed), encoding="utf-8")
            run_hil([*solve, "--vehicle-s", str(MOST_VEHICLE_S), "--out", "designed"], folder, LIMIT_S)
            for name in EXPERIMENTS:
                run_hil(["run", "rig.toml", name, "--out", f"{name}.csv", "--pace", "fast"], folder, LIMIT_S)
            given = [word for name in EXPERIMENTS for word in ("--rec", f"{name}.csv")]
            run_hil([*solve, *given, "--vehicle-s", "0", "--out", "fixed"], folder, LIMIT_S)
            ways = {name: Settled.read(folder / name) for name in WAYS}
            truth = verify(sealed.commitment, sealed.open())
    hidden = sorted(truth["hidden"])
    judged = {name: way.document(hidden) for name, way in ways.items()}
    return {"seed": seed, "alike": alike, "hidden": hidden, **judged}


def report(rows: Sequence[Row]) -> str:
    """Return the table by what is alike, and the promises."""
    lines = []
    for title in [*ALIKE, "all"]:
        group = [row for row in rows if title in ("all", row["alike"])]
        if group:
            counts = (sum(row[way][what] for row in group) for way, what in product(WAYS, ("decided", "right")))
            lines.append((title, *(f"{count} of {len(group)}" for count in counts)))
    head = ("concealed", "designed: decided", "and right", "fixed: decided", "and right")
    designed = [row["designed"] for row in rows if row["designed"]["promised"]]
    if not designed:
        return table(head, lines)
    mean = sum(each["promised"][-1] for each in designed) / len(designed)
    came = sum(each["right"] for each in designed)
    return f"{table(head, lines)}\nThe last design promised {mean:.0%} right; right are {came} of {len(designed)}.\n"


def main() -> int:
    """Answer the rigs that are not answered yet, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=parse_seeds, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--effort", default="normal")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    path = asked.out / "experiments.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    known = {row["seed"] for row in rows}
    for seed in asked.seeds:
        if seed not in known:
            try:
                rows.append(answered(seed, asked.effort))
            except CommandFailed as refused:  # printed, and not counted: a run that the supervision ended is no verdict
                sys.stderr.write(f"seed {seed}: {refused}\n")
                continue
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
    sys.stdout.write(report([row for row in rows if row["seed"] in asked.seeds]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
