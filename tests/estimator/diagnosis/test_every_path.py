"""From file to verdict: every structure and output, over sampling periods, tolerances and numbers of recordings.

A line is scaled so that its modes are as many samples long at every period. What is asked is that there is a verdict,
and that all of the contract's file is there and finite; who is right is asked elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from estimator.diagnosis.diagnose import diagnose
from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.model import Structure
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, Location, OutputKind
from hil.config.model_file import read_model_for_recordings
from hil.recording import read_records
from hil.report.diagnosis_json import diagnosis_json
from tests.chosen import one_in
from tests.estimator.physics.bench import ONE_MASS, THREE_MASS, TWO_MASS, model, random_steps, record

SAMPLES = 500
PERIODS_S = (1e-4, 1e-3, 1e-2, 1e-1)
TOLERANCES = (0.0, 0.2, 0.99)
COUNTS = (1, 2, 3, 8)
FORMATS = ("csv", "parquet")
OUTPUTS = ("speed", "speed at the load", "position")
PATHS = [
    *((Structure.ONE_MASS, output) for output in ("speed", "position")),
    *((structure, output) for structure in (Structure.TWO_MASS, Structure.THREE_MASS) for output in OUTPUTS),
    (Structure.JOINT, "torque"),
]
LINES = {
    Structure.ONE_MASS: ONE_MASS,
    Structure.TWO_MASS: TWO_MASS,
    Structure.THREE_MASS: THREE_MASS,
    Structure.JOINT: {"k": 4200.0, "c": 9.0},
}

Case = tuple[Structure, str, float, float, int, str]


def line_at(structure: Structure, period_s: float) -> dict[str, float]:
    """The line with modes as many samples long at any period: inertias, dampers and springs in its time."""
    slower = period_s / 0.01
    power = {"J": 1.0, "c": 0.0, "b": 0.0, "k": -1.0}
    return {name: value * slower ** power[name[0]] for name, value in LINES[structure].items()}


def cases() -> Iterator[Case]:
    """Every structure and output once; each period, tolerance, number and format with several of them."""
    for i, (structure, output) in enumerate(PATHS):
        yield (
            structure,
            output,
            PERIODS_S[i % 4],
            TOLERANCES[i % 3],
            COUNTS[(i + i // 4) % 4],
            FORMATS[i % 2],
        )


def every_case() -> Iterator[Case]:
    """Every structure and output with each period, tolerance and number."""
    for i, (structure, output) in enumerate(PATHS):
        for period_s in PERIODS_S:
            for tolerance in TOLERANCES:
                for count in COUNTS:
                    yield structure, output, period_s, tolerance, count, FORMATS[i % 2]


def driven(structure: Structure, output: str, period_s: float, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return what drives a line and what is read of it, shape (N,): of a joint its twist and its torque."""
    values = line_at(structure, period_s)
    noise = np.random.default_rng(seed).standard_normal(SAMPLES)
    torque = random_steps(SAMPLES, seed) + 80.0 * np.sin(2.0 * np.pi * np.arange(SAMPLES) / 250.0 + seed)
    if structure is Structure.JOINT:
        twist = np.cumsum(torque) / np.abs(np.cumsum(torque)).max() * 0.05
        rate = np.gradient(twist, period_s)
        clean = values["k"] * twist + values["c"] * rate
    else:
        kind = OutputKind.POSITION if output == "position" else OutputKind.SPEED
        location = Location.LOAD if "load" in output else Location.MOTOR
        silent = record(torque, sample_time_s=period_s, kind=kind, location=location)
        line = three_masses(values) if structure is Structure.THREE_MASS else model(values)
        clean = simulate(
            grid_for(line, [silent]), silent, flat_values(values, {}), InitialCondition(5.0, 0.0, 2.0, 0.0, 2.0)
        )
        twist = torque
    return twist, clean + 2e-3 * float(np.ptp(clean)) * noise


def three_masses(values: dict[str, float]) -> Any:
    """The bench's own builder knows one and two masses."""
    from dataclasses import replace

    from estimator.physics.model import Parameter

    two = {name: values[name] for name in TWO_MASS}
    return replace(
        model(two), structure=Structure.THREE_MASS, parameters={k: Parameter(v, 0.2) for k, v in values.items()}
    )


def files(case: Case, folder: Path) -> tuple[Path, list[Path]]:
    """Write model file and recordings."""
    structure, output, period_s, tolerance, count, form = case
    values = line_at(structure, period_s)
    lines = [f"{name} = {{ value = {value!r}, tolerance = {tolerance} }}" for name, value in values.items()]
    where = ', at = "load"' if "load" in output else ""
    if structure is Structure.JOINT:
        signals = 'position = { column = "in" }\ntorque = [ { column = "out" } ]'
    else:
        kind = "position" if output == "position" else "speed"
        signals = f'torque = [ {{ column = "in" }} ]\n{kind} = {{ column = "out"{where} }}'
    text = f'schema = "hil.model/1"\nstructure = "{structure.value}"\n[parameters]\n' + "\n".join(lines)
    (folder / "model.toml").write_text(f'{text}\n[signals]\ntime = {{ column = "t" }}\n{signals}\n', encoding="utf-8")
    paths = []
    for seed in range(1, count + 1):
        drive, read = driven(structure, output, period_s, seed)
        table = {"t": np.arange(SAMPLES) * period_s, "in": drive, "out": read}
        path = folder / f"run_{seed}.{form}"
        if form == "csv":
            np.savetxt(path, np.column_stack(list(table.values())), "%.9g", ",", header="t,in,out", comments="")
        else:
            pyarrow.parquet.write_table(pyarrow.table(table), path)
        paths.append(path)
    return folder / "model.toml", paths


def numbers(content: Any) -> Iterator[float]:
    """Every number of a JSON document."""
    for each in content.values() if isinstance(content, dict) else content if isinstance(content, list) else ():
        yield from numbers(each)
    if isinstance(content, float):
        yield content


def has_a_verdict(case: Case, folder: Path) -> None:
    path, recordings = files(case, folder)
    file = read_model_for_recordings(path)
    records = read_records(recordings, file.signals, file.on_bench)
    content = diagnosis_json(diagnose(records, file.model, effort="quick"))
    assert content["verdict"] in {"no_mismatch", "explained", "partly_explained", "unexplained"}
    assert all(math.isfinite(each) for each in numbers(content))
    fit = content["fit"]
    assert None not in fit.values()
    assert fit["noise_floor"] > 0.0
    assert fit["retuned"] <= 1.01 * fit["nominal"]
    assert set(content["parameters"]) == set(LINES[case[0]])
    assert len(content["load_torque"]) == case[4]
    assert all(each["name"] for each in content["effects"])


def named(case: Case) -> str:
    structure, output, period_s, tolerance, count, form = case
    return f"{structure.value}-{output}-{period_s:g}s-{tolerance}-{count}-{form}"


@pytest.mark.parametrize("case", one_in(3, [(case,) for case in cases()]), ids=named)
def test_every_structure_and_output_comes_to_a_verdict(case: Case, tmp_path: Path) -> None:
    has_a_verdict(case, tmp_path)


@pytest.mark.campaign
@pytest.mark.parametrize("case", list(every_case()), ids=named)
def test_so_it_does_over_every_period_tolerance_and_number(case: Case, tmp_path: Path) -> None:
    has_a_verdict(case, tmp_path)
