"""``python -m tests.campaigns.fleet --out DIR``: which of 200 buses have a weakened shaft.

Buses of one type: what differs from bus to bus, from drive to drive, and the fault were chosen before anything was
computed, so that one drive should find about half (`BETWEEN`, `WITHIN`, `FAULT`). Each drive is simulated on a rough
road by the benchmarks' own bus, which shares nothing with the estimator, and its resonance identified as ``hil
identify`` does, on Dask. One drive alone is judged by the fleet's first drives; all drives of a bus by the hierarchical
model of `hil.fleet.pooling`; both at the same threshold. ``DIR/drives.jsonl`` has a line for each drive; called again,
the campaign continues where it was interrupted.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from distributed import Future

from estimator.errors import EstimatorError
from estimator.identification.best import best_estimate
from estimator.physics.parallel import work_on
from hil.fleet.pooling import Pooled, Seen, Usual, pooled, usual
from hil.fleet.run import Engine, client_of, hand_out
from tests.benchmarks.buses import Line, draw_bus, drive

TYPE = Line(J_M=1.6, J_L=100.0, k=4200.0, c=9.0, b_M=0.35, b_L=0.9)
BETWEEN = {"k": 0.02, "J_M": 0.01, "c": 0.1}
"""Standard deviation from bus to bus, relative: what a maker's tolerances leave."""

WITHIN = {"k": 0.04, "J_L": 0.1, "c": 0.1}
"""From drive to drive: temperature of the couplings, payload."""

FAULT = {"k": 0.86}
VEHICLES, FAULTY, DRIVES, SECONDS = 200, 10, range(1, 4), 4.0
"""Drives are counted from 1: a seed that ends in 0 is the one without it, here that of the bus."""


Drive = tuple[int, int]
Row = dict[str, Any]


def line_of(vehicle: int, number: int) -> Line:
    """Return the driveline of a bus as it is in one drive; the last ones have the fault."""
    own, day = np.random.default_rng([57, vehicle]), np.random.default_rng([57, vehicle, number])
    line = TYPE
    for spread, rng in ((BETWEEN, own), (WITHIN, day)):
        line = replace(line, **{name: getattr(line, name) * np.exp(rng.normal(0.0, s)) for name, s in spread.items()})
    fault = FAULT if is_faulty(vehicle) else {}
    return replace(line, **{name: getattr(line, name) * by for name, by in fault.items()})


def is_faulty(vehicle: int) -> bool:
    return vehicle >= VEHICLES - FAULTY


def resonance_of(at: Drive) -> Row:
    """Drive and identify."""
    work_on(1)
    vehicle, number = at
    bus = replace(draw_bus(vehicle), line=line_of(vehicle, number))
    row: Row = {"vehicle": vehicle, "drive": number, "true_hz": bus.line.resonance()[0], "hz": None, "std": None}
    try:
        mode = best_estimate(drive(bus, SECONDS, number)).mode
    except EstimatorError as error:
        return row | {"error": str(error)}
    return row if mode is None else row | {"hz": mode.frequency_hz.value, "std": mode.frequency_hz.std}


def read_rows(path: Path) -> list[Row]:
    """Return the drives that were done; a last line that was cut is none."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    rows = []
    for line in lines:
        try:
            rows.append(json.loads(line))
        except ValueError:
            continue
    return rows


def identify_all(path: Path, drives: list[Drive], jobs: int) -> list[Row]:
    """Identify what is not in the file yet."""
    known = {(row["vehicle"], row["drive"]) for row in read_rows(path)}
    todo = [each for each in drives if each not in known]
    if todo:
        with client_of(Engine(workers=jobs)) as client, path.open("a", encoding="utf-8") as file:
            file.write("\n")  # a line that was cut ends here

            def submit(at: Drive) -> Future:
                return client.submit(resonance_of, at, pure=False, retries=2)

            for at, row, error in hand_out(lambda: client, todo, submit):
                if error:
                    raise RuntimeError(f"drive {at}: {error}")
                file.write(json.dumps(row) + "\n")
                file.flush()
    return sorted(read_rows(path), key=lambda row: (row["vehicle"], row["drive"]))


def judged(rows: list[Row], drives: range) -> tuple[Usual, dict[int, Pooled]]:
    """Judge every bus by some of its drives."""
    seen = {}
    for vehicle in sorted({row["vehicle"] for row in rows}):
        of = [r for r in rows if r["vehicle"] == vehicle and r["drive"] in drives and r["hz"] is not None]
        if of:
            seen[vehicle] = Seen(np.array([r["hz"] for r in of]), np.array([r["std"] for r in of]))
    known = usual(list(seen.values()))
    return known, {vehicle: pooled(each, known) for vehicle, each in seen.items()}


def line_for(what: str, known: Usual, found: dict[int, Pooled]) -> str:
    """Return the line of one way to judge."""
    hits = sum(each.is_outlier for vehicle, each in found.items() if is_faulty(vehicle))
    false = sum(each.is_outlier for vehicle, each in found.items() if not is_faulty(vehicle))
    sound = sum(not is_faulty(vehicle) for vehicle in found)
    return (
        f"{what}: {hits} of {sum(map(is_faulty, found))} found, {false} of {sound} sound ones named; usual "
        f"{known.mean:.3f} Hz, from bus to bus {known.between:.3f}, from drive to drive {known.within:.3f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    drives = [(vehicle, number) for number in DRIVES for vehicle in range(VEHICLES)]
    rows = identify_all(options.out / "drives.jsonl", drives, options.jobs)
    print(f"{len(rows)} drives, {sum(row['hz'] is None for row in rows)} without a resonance")
    for number in DRIVES:
        print(line_for(f"drive {number} alone", *judged(rows, range(number, number + 1))))
    print(line_for(f"{len(DRIVES)} drives together", *judged(rows, DRIVES)))


if __name__ == "__main__":
    main()
