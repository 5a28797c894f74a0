"""Seventy mistakes of people who bring a recording, each in a file of its own: ``python -m tests.campaigns.mistakes``.

A bus with two motors is simulated; its model is off by as much as models are. Then one thing is written wrongly. What a
person reads then is judged by what comes of it: the lines that they are asked to paste are pasted and the recording is
read again. ``right`` is a mistake that is undone then, or needs nothing, or that only a person can undo and is named;
``named`` is one that is among those listed; ``wrong`` has lines that read something else; ``silent`` has no word.
"""

from __future__ import annotations

import re
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from estimator.physics.driveline import InitialCondition
from estimator.physics.model import DrivelineModel, Motion
from estimator.signals.record import FloatArray, OutputKind, Record
from hil.errors import HilError
from hil.plants.scales import tell_doubts
from hil.recording import SignalsConfig, read_record
from tests.estimator.physics.bench import exact_states, model

BUS = {"J_M": 1.6, "J_L": 92.0, "k": 4200.0, "c": 9.0, "b_M": 0.35, "b_L": 0.9}
BUS_NOMINAL = {"J_M": 1.5, "J_L": 100.0, "k": 4500.0, "c": 8.0, "b_M": 0.3, "b_L": 1.0}
RIG, RIG_NOMINAL = {"J_M": 0.9, "b_M": 0.05}, {"J_M": 1.0, "b_M": 0.06}

PERIOD_S, ROWS = 0.01, 3000
Columns = dict[str, FloatArray]


@cache
def driven(kind: str) -> Mapping[str, FloatArray]:
    """Simulate time, torques, speed and angle of the bus in tip-ins or a cruise, or of a rig with one mass."""
    rng = np.random.default_rng({"tip": 1, "cruise": 2, "rig": 3, "back": 4, "even": 5}[kind])
    values, size = (RIG, 15.0) if kind == "rig" else (BUS, 130.0)
    course = np.repeat(rng.choice([-0.6, 0.1, 1.0, 1.4], size=ROWS // 100 + 1), 100)[:ROWS]
    prbs = np.repeat(rng.choice([-0.25, 0.25], size=ROWS // 6 + 1), 6)[:ROWS]
    torque = size * (prbs + (0.25 if kind == "cruise" else course))
    half, own = 0.55, 0.1 * size * np.cumsum(rng.standard_normal(ROWS)) / np.sqrt(ROWS)
    if kind == "even":
        half, own = 0.5, np.zeros(ROWS)
    T1, T2 = (np.round(each, 2) for each in (half * torque + own, (1.0 - half) * torque - own))
    course = course - 0.7 if kind == "back" else course
    speed = {"rig": 30.0, "back": 5.0}.get(kind, 45.0)
    states = exact_states(
        values, T1 + T2, InitialCondition(0.0, speed, values.get("b_L", 0.05) * speed / 4200.0, 0.0, speed)
    )
    return {
        "t": PERIOD_S * np.arange(ROWS),
        "T1": T1,
        "T2": T2,
        "n": states[:, 1] + 0.02 * rng.standard_normal(ROWS),
        "angle": states[:, 0],
    }


def csv(columns: Mapping[str, FloatArray | Sequence[str]], separator: str = ",", decimal: str = ".") -> str:
    """Write columns as text."""
    cells = [
        [cell if isinstance(cell, str) else f"{cell:.10g}".replace(".", decimal) for cell in column]
        for column in columns.values()
    ]
    return "\n".join(separator.join(row) for row in [list(columns), *map(list, zip(*cells, strict=True))]) + "\n"


SIGNALS: dict[str, Any] = {
    "time": {"column": "t"},
    "torque": [{"column": "T1"}, {"column": "T2"}],
    "speed": {"column": "n", "at": "motor"},
}


@dataclass(frozen=True)
class Mistake:
    """One mistake: what it does to the columns, the file, ``[signals]`` or the model; and how it is named."""

    words: str
    columns: Callable[[Columns], Mapping[str, Any]] = dict
    of: str = "tip"
    signals: Mapping[str, Any] = field(default_factory=dict)
    write: Callable[[Mapping[str, Any]], str] = csv
    nominal: Mapping[str, float] = field(default_factory=dict)
    gear_ratio: float | None = None
    motion: Motion = Motion.ROTATION
    by_hand: bool = False
    """Whether the recording alone can't tell what to write, so that naming it is all there is to do."""
    within: float = 0.02
    """Share by which what is read then may be off: a rated torque is only as exact as the model."""


def times(**factors: float) -> Callable[[Columns], Columns]:
    return lambda read: {name: values * factors.get(name, 1.0) for name, values in read.items()}


def both(factor: float, decimals: int | None = None) -> Callable[[Columns], Columns]:
    def scaled(read: Columns) -> Columns:
        changed = {name: read[name] * factor for name in ("T1", "T2")}
        return read | ({k: np.round(v, decimals) for k, v in changed.items()} if decimals is not None else changed)

    return scaled


def put(**columns: Callable[[Columns], Any]) -> Callable[[Columns], dict[str, Any]]:
    return lambda read: read | {name: of(read) for name, of in columns.items()}


def stamps(form: Callable[[float], str]) -> Callable[[Columns], dict[str, Any]]:
    return put(t=lambda read: [form(second) for second in read["t"]])


RPM, DEGREE = 30.0 / np.pi, 180.0 / np.pi
ROUGH = 0.3
GEAR = r"at the wheel|gear ratio|reflected"
GERMAN = "02.03.2026 10:15:"

MISTAKES: dict[str, Mistake] = {
    "speed in rpm": Mistake("rpm", times(n=RPM)),
    "speed in rpm, a cruise": Mistake("rpm", times(n=RPM), of="cruise"),
    "speed in rpm, one mass": Mistake("rpm", times(n=RPM), of="rig"),
    "speed in deg/s": Mistake("degrees", times(n=DEGREE)),
    "speed in turns per second": Mistake("turns per second", times(n=0.5 / np.pi)),
    "rad/s scaled as rpm": Mistake(
        "as if it were in rpm", signals={"speed": {"column": "n", "scale": 1.0 / RPM, "at": "motor"}}
    ),
    "km/h, a translation": Mistake("km/h", times(n=3.6), motion=Motion.TRANSLATION),
    "mm/s, a translation": Mistake("thousandths", times(n=1e3), motion=Motion.TRANSLATION),
    "the vehicle's km/h for the motor's speed": Mistake("km/h", times(n=0.2), within=ROUGH),
    "torque in kNm": Mistake("kNm", both(1e-3)),
    "torque in kNm, one mass": Mistake("kNm", both(1e-3), of="rig"),
    "torque in mNm": Mistake("mNm", both(1e3)),
    "force in kN": Mistake("kN", both(1e-3), motion=Motion.TRANSLATION),
    "torque in % of 600 Nm": Mistake("per cent", both(100.0 / 600.0), within=ROUGH),
    "torque in % of 250 Nm": Mistake("per cent", both(100.0 / 250.0), within=ROUGH),
    "torque in % of 40 Nm, one mass": Mistake("per cent", both(100.0 / 40.0), of="rig", within=ROUGH),
    "torque in whole per mille of 600 Nm": Mistake("per mille", both(1000.0 / 600.0, 0), within=ROUGH),
    "torque in whole per mille of 250 Nm": Mistake("per mille", both(1000.0 / 250.0, 0), within=ROUGH),
    "torque in whole per mille of 2000 Nm": Mistake("per mille", both(1000.0 / 2000.0, 0), within=ROUGH),
    "torque in per mille of 200 Nm": Mistake("per mille", both(1000.0 / 200.0), within=ROUGH),
    "torque as a share of 600 Nm": Mistake("share of a rated", both(1.0 / 600.0), within=ROUGH),
    "torque of one phase": Mistake("one of three phases", both(1.0 / 3.0)),
    "a current for the torque": Mistake("current", both(1.0 / 0.3), within=ROUGH),
    "torque at the wheel": Mistake(GEAR, both(6.0), within=ROUGH),
    "speed at the wheel": Mistake(GEAR, times(n=1.0 / 6.0), within=ROUGH),
    "torque at the wheel, ratio known": Mistake(GEAR, both(6.0), gear_ratio=6.0),
    "speed at the wheel, ratio known": Mistake(GEAR, times(n=1.0 / 8.0), gear_ratio=8.0),
    "a speed reflected twice": Mistake(GEAR, times(n=6.0), gear_ratio=6.0),
    "the inverse of the gear ratio": Mistake(
        GEAR,
        both(6.0),
        gear_ratio=6.0,
        signals={"torque": [{"column": "T1", "scale": 6.0}, {"column": "T2", "scale": 6.0}]},
    ),
    "sign of the speed": Mistake("sign", times(n=-1.0)),
    "sign of both torques": Mistake("sign", both(-1.0)),
    "sign of the first torque": Mistake("sign", times(T1=-1.0)),
    "sign of the second torque": Mistake("sign", times(T2=-1.0)),
    "sign of the first torque, a cruise": Mistake("sign", times(T1=-1.0), of="cruise"),
    "sign of the second torque, one mass": Mistake("sign", times(T2=-1.0), of="rig"),
    "equal torques of opposite sign": Mistake("cancel", times(T2=-1.0), of="even"),
    "time in ms": Mistake("ms", times(t=1e3)),
    "time in us": Mistake("us", times(t=1e6)),
    "time in ms, one mass": Mistake("ms", times(t=1e3), of="rig"),
    "row numbers as time": Mistake("numbers of the rows", put(t=lambda read: np.arange(ROWS)), by_hand=True),
    "row numbers from 1": Mistake("numbers of the rows", put(t=lambda read: np.arange(ROWS) + 1), by_hand=True),
    "row numbers said to be seconds": Mistake(
        "sampling period", put(t=lambda read: np.arange(ROWS)), signals={"time": {"column": "t", "scale": 1.0}}
    ),
    "period of 1 ms for 10 ms": Mistake("sampling period", signals={"time": {"sample_time_s": 0.001}}),
    "period of 100 ms for 10 ms": Mistake("sampling period", signals={"time": {"sample_time_s": 0.1}}),
    "period of 5 ms for 10 ms": Mistake("sampling period", signals={"time": {"sample_time_s": 0.005}}),
    "first torque and speed swapped": Mistake("swapped", put(T1=lambda read: read["n"], n=lambda read: read["T1"])),
    "second torque and speed swapped": Mistake("swapped", put(T2=lambda read: read["n"], n=lambda read: read["T2"])),
    "a dead torque": Mistake(r"\(T2\) stays at 0", times(T2=0.0), by_hand=True),
    "a dead torque, the first": Mistake(r"\(T1\) stays at 0", times(T1=0.0), by_hand=True),
    "a constant torque": Mistake(r"\(T2\) stays at 42", put(T2=lambda read: np.full(ROWS, 42.0)), by_hand=True),
    "a constant speed": Mistake("speed is constant at 45", put(n=lambda read: np.full(ROWS, 45.0)), by_hand=True),
    "a dead speed": Mistake("speed is constant at 0", times(n=0.0), by_hand=True),
    "one column named twice": Mistake("twice", signals={"torque": [{"column": "T1"}, {"column": "T1"}]}, by_hand=True),
    "one channel logged twice": Mistake("equal in every row", put(T2=lambda read: read["T1"]), by_hand=True),
    "a clipped speed": Mistake("clipped|cut off", put(n=lambda read: np.minimum(read["n"], 50.0)), by_hand=True),
    "a clipped torque": Mistake("clipped|cut off", put(T1=lambda read: np.minimum(read["T1"], 60.0)), by_hand=True),
    "torques of 16 bit read without a sign": Mistake("sign", put(T1=lambda r: np.round(r["T1"]) % 2**16), within=0.05),
    "a speed of 16 bit read without a sign": Mistake(
        "sign",
        put(n=lambda read: np.round(100.0 * read["n"]) % 2**16),
        of="back",
        signals={"speed": {"column": "n", "scale": 0.01, "at": "motor"}},
    ),
    "an angle for the speed": Mistake("is the speed a position", put(n=lambda read: read["angle"])),
    "an angle in degrees for the speed": Mistake("is the speed a position", put(n=lambda read: DEGREE * read["angle"])),
    "the model of a vehicle ten times as heavy": Mistake(
        "inertia in the model file", nominal={"J_M": 15.0, "J_L": 1000.0}, by_hand=True
    ),
    "the model of a rig ten times as heavy": Mistake(
        "inertia in the model file", of="rig", nominal={"J_M": 10.0}, by_hand=True
    ),
    "the model's inertia in kg cm^2": Mistake(
        "inertia in the model file", nominal={"J_M": 15000.0, "J_L": 1e6}, by_hand=True
    ),
    "rpm, and per cent of 600 Nm": Mistake("rpm", lambda r: both(100.0 / 600.0)(times(n=RPM)(r)), within=ROUGH),
    "semicolons and decimal commas": Mistake("", write=lambda each: csv(each, ";", ",")),
    "decimal commas between commas": Mistake("decimal commas", write=lambda each: csv(each, ",", ","), by_hand=True),
    "German dates": Mistake(
        "",
        stamps(lambda s: f"{GERMAN}{s:06.3f}".replace(".", ",").replace(",", ".", 2)),
        write=lambda each: csv(each, ";", ","),
    ),
    "US dates": Mistake("", stamps(lambda s: f"3/2/2026 10:15:{s:06.3f} AM")),
    "dates with a time zone": Mistake("", stamps(lambda s: f"2026-03-02T10:15:{s:06.3f}+01:00")),
    "times of day": Mistake("", stamps(lambda s: f"10:15:{s:06.3f}")),
    "day numbers of a spreadsheet": Mistake("", stamps(lambda s: f"{46083.4 + s / 86400.0:.9f}"), within=0.05),
}


@dataclass(frozen=True)
class Outcome:
    """What came of a mistake, and what was said."""

    kind: str
    said: str


def judge(mistake: Mistake, folder: Path) -> Outcome:
    """Write the file, read it as a person would, paste the lines, and say what came of it."""
    true = driven(mistake.of)
    path = folder / "run.csv"
    columns = mistake.columns(dict(true))
    path.write_text(mistake.write({name: columns[name] for name in ("t", "T1", "T2", "n")}), "utf-8")
    nominal = {**(RIG_NOMINAL if mistake.of == "rig" else BUS_NOMINAL), **mistake.nominal}
    line = model(nominal, 0.2, motion=mistake.motion)
    line = DrivelineModel(line.structure, line.parameters, line.motion, gear_ratio=mistake.gear_ratio)
    signals = {**SIGNALS, **mistake.signals}
    said, record = said_of(path, signals, line)
    lines = pasted(said)
    if lines:
        for key, value in lines.items():
            signals = {name: each for name, each in signals.items() if not (key in OUTPUTS and name in OUTPUTS)}
            signals[key] = value
        _, record = said_of(path, signals, line)
        return Outcome("right" if record is not None and is_true(record, true, mistake.within) else "wrong", said)
    if not said and mistake.words:
        return Outcome("silent", said)
    if not mistake.words:
        is_read = record is not None and is_true(record, true, mistake.within)
        return Outcome("right" if is_read else "silent", said)
    if re.search(mistake.words, said) is None:
        return Outcome("another named", said)
    return Outcome("right" if mistake.by_hand else "named", said)


OUTPUTS = ("speed", "position")


def said_of(path: Path, signals: Mapping[str, Any], line: DrivelineModel) -> tuple[str, Record | None]:
    """Return all that ``hil look FILE --model MODEL`` tells of a file, and the recording where it could be read."""
    said: list[str] = []
    config = SignalsConfig.model_validate(dict(signals))
    try:
        record = read_record(path, config, tell=said.append)
    except HilError as error:
        return "\n".join([*said, str(error)]), None
    tell_doubts([record], [path], line, config, None, said.append)
    return "\n".join(said), record


ENTRY = re.compile(r"[Ww]rite (\{ column = '(\w+)'.*?\})")


def pasted(said: str) -> dict[str, Any]:
    """Return the lines of [signals] that a person is asked to write."""
    found: dict[str, Any] = {}
    for text in re.findall(r"In \[signals\] write: (.*)", said):
        found |= tomllib.loads(re.sub(r"  (?=\w+ = )", "\n", text))
    for entry, column in ENTRY.findall(said):
        value = tomllib.loads(f"x = {entry}".replace("'", '"'))["x"]
        if column == "n":
            found["speed"] = {**value, "at": "motor"}
        else:
            found["torque"] = [value if each["column"] == column else each for each in SIGNALS["torque"]]
    return found


def is_true(record: Record, true: Mapping[str, FloatArray], within: float) -> bool:
    """Tell whether a recording is the true one."""
    output = true["angle"] if record.kind is OutputKind.POSITION else true["n"]
    pairs: Iterator[tuple[Any, Any]] = iter(
        [
            (np.abs(record.torque_nm).sum(axis=0), [np.abs(true[name]).sum() for name in ("T1", "T2")]),
            (np.abs(record.total_torque_nm).sum(), np.abs(true["T1"] + true["T2"]).sum()),
            (np.ptp(record.output), np.ptp(output)),
            (np.abs(record.output).sum(), np.abs(output).sum()),
            (record.sample_time_s, PERIOD_S),
        ]
    )
    is_one_way = float(record.total_torque_nm @ (true["T1"] + true["T2"])) * float(record.output @ output) > 0.0
    return is_one_way and all(np.allclose(read, known, rtol=within) for read, known in pairs)


def main() -> int:
    """Print what comes of every mistake, and how often; all that was said with ``--said``."""
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for name, mistake in MISTAKES.items():
            outcome = judge(mistake, Path(folder))
            counts[outcome.kind] += 1
            print(f"{name:45} {outcome.kind}")
            if "--said" in sys.argv[1:]:
                print("    " + outcome.said.replace("\n", "\n    "))
    print(f"\n{len(MISTAKES)} mistakes: " + ", ".join(f"{count} {kind}" for kind, count in counts.most_common()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
