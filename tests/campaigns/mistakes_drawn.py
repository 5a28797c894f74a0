"""Mistakes drawn from a grammar, three recordings each: ``python -m tests.campaigns.mistakes_drawn [COUNT] [SEED]``.

One is a unit, a column, a sign, a shift between columns, a gain or a period, made in all recordings of a call or in one
alone. What a person reads is judged as in ``mistakes``: ``right`` where the lines to paste give the true recording,
``named`` where the cause is among those listed (and the recording, where it is one alone), ``something else`` where the
tool says that nothing it knows fits, ``another named`` where other causes alone are listed, ``wrong`` where a line
gives something else, ``silent`` where there is no word. A gain within what physics makes is no mistake that a file can
show.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from estimator.physics.model import DrivelineModel
from estimator.signals.record import FloatArray, Record
from hil.errors import HilError
from hil.plants.scales import tell_doubts
from hil.recording import SignalsConfig, read_record
from tests.campaigns.mistakes import (
    BUS_NOMINAL,
    DEGREE,
    OUTPUTS,
    ROUGH,
    RPM,
    SIGNALS,
    Columns,
    csv,
    driven,
    is_true,
    pasted,
    times,
)
from tests.estimator.physics.bench import model

RECORDINGS = ("tip", "cruise", "back")
TIMES_ITS_OWN = r"unit of its own|per cent|per mille|current|equal inverters|count|phases|share|another vehicle|gear"


@dataclass(frozen=True)
class Drawn:
    """One mistake: its words, what it does to columns, ``[signals]`` or the model, and the recordings it is in."""

    words: str
    named: str  # a pattern of the cause
    columns: Callable[[Columns], Mapping[str, Any]] = dict
    signals: Mapping[str, Any] | None = None
    nominal: Mapping[str, float] | None = None
    recordings: tuple[str, ...] = RECORDINGS


def drawn(rng: np.random.Generator) -> Drawn:
    """Draw a kind, its size, its column, and which recordings have it."""
    kinds = (_unit, _column, _sign, _shift, _gain, _period, _inertia)
    found = kinds[int(rng.integers(len(kinds)))](rng)
    may_be_alone = found.signals is None and found.nominal is None
    if may_be_alone and rng.random() < 1.0 / 3.0:
        one = str(rng.choice(RECORDINGS))
        return Drawn(f"{found.words}, in {one} alone", found.named, found.columns, recordings=(one,))
    return found


def _factors(columns: tuple[str, ...], factor: float, decimals: int | None = None) -> Callable[[Columns], Columns]:
    def changed(read: Columns) -> Columns:
        found = times(**dict.fromkeys(columns, factor))(read)
        return found if decimals is None else found | {name: np.round(found[name], decimals) for name in columns}

    return changed


def _unit(rng: np.random.Generator) -> Drawn:
    rated = float(rng.uniform(150.0, 650.0))  # beyond, a per mille is a gain that payload and friction make, too
    gear = float(rng.uniform(3.5, 12.0))
    torques = {
        "kNm": ("kNm", 1e-3, None),
        "mNm": ("mNm", 1e3, None),
        f"per cent of {rated:.0f} Nm": ("per cent", 100.0 / rated, None),
        f"whole per mille of {rated:.0f} Nm": ("per mille", 1000.0 / rated, 0),
        f"at the wheel by {gear:.2g}": ("wheel|gear", gear, None),
    }
    speeds = {
        "rpm": ("rpm", RPM, None),
        "degrees per second": ("degrees", DEGREE, None),
        "turns per second": ("turns", 0.5 / np.pi, None),
        f"at the wheel by {gear:.2g}": ("wheel|gear", 1.0 / gear, None),
    }
    columns, units = ((("T1", "T2"), torques), (("T1",), torques), (("T2",), torques), (("n",), speeds))[
        int(rng.integers(4))
    ]
    words = str(rng.choice(list(units)))
    named, factor, decimals = units[words]
    named = named if len(columns) == 2 or columns == ("n",) else f"{named}|unit of its own"
    return Drawn(f"{' and '.join(columns)} in {words}", named, _factors(columns, factor, decimals))


def _column(rng: np.random.Generator) -> Drawn:
    def unsigned(read: Columns) -> Columns:
        return read | {"T2": np.round(read["T2"]) % 2**16}

    def dead(read: Columns) -> Columns:
        return read | {"T2": np.where(read["t"] < 5.0, 0.0, read["T2"])}

    def prbs(read: Columns) -> Columns:
        return read | {"P": np.random.default_rng(3).choice([-30.0, 30.0], size=read["t"].size)}

    which = int(rng.integers(8))
    name = ("T1", "T2")[int(rng.integers(2))]
    return (
        Drawn("T2 is not named", "T2 looks like a torque|equal inverters", signals={"torque": [{"column": "T1"}]}),
        Drawn("T1 is not named", "T1 looks like a torque|equal inverters", signals={"torque": [{"column": "T2"}]}),
        Drawn("T2 is the sum", "count twice|counts twice", lambda r: r | {"T2": r["T1"] + r["T2"]}),
        Drawn(f"{name} and the speed swapped", "swapped", lambda r: r | {name: r["n"], "n": r[name]}),
        Drawn("an angle for the speed", "is the speed a position", lambda r: r | {"n": r["angle"]}),
        Drawn("T2 of 16 bit without its sign", "sign|wraps", unsigned),
        Drawn("T2 dead for 5 s", "dead", dead),
        Drawn("a PRBS for the torque", "look like torques|looks like a torque", prbs, {"torque": [{"column": "P"}]}),
    )[which]


def _sign(rng: np.random.Generator) -> Drawn:
    columns = (("n",), ("T1",), ("T2",), ("T1", "T2"))[int(rng.integers(4))]
    return Drawn(f"sign of {' and '.join(columns)}", "sign|cancel", _factors(columns, -1.0))


def _shift(rng: np.random.Generator) -> Drawn:
    lag_s = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.08, 0.6))
    rows = round(lag_s / 0.01)

    def late(read: Columns) -> Columns:
        speed: FloatArray = np.roll(read["n"], rows)
        speed[slice(0, rows) if rows > 0 else slice(rows, None)] = read["n"][0 if rows > 0 else -1]
        return read | {"n": speed}

    return Drawn(f"speed shifted by {lag_s:.2f} s", "shift between columns", late)


def _gain(rng: np.random.Generator) -> Drawn:
    columns = (("T1", "T2"), ("T1",), ("T2",), ("n",))[int(rng.integers(4))]
    gain = float(np.exp(rng.choice([-1.0, 1.0]) * rng.uniform(np.log(4.0), np.log(40.0))))
    return Drawn(f"{' and '.join(columns)} times {gain:.3g}", TIMES_ITS_OWN + "|speed", _factors(columns, gain))


def _period(rng: np.random.Generator) -> Drawn:
    factor = float(rng.choice([1e3, 1e6, 10.0, 0.1, 0.5, 2.0]))
    return Drawn(f"time times {factor:g}", "period|sampled", _factors(("t",), factor))


def _inertia(rng: np.random.Generator) -> Drawn:
    unit, factor = (("kg cm2", 1e4), ("g cm2", 1e7), ("GD2", 4.0), ("36 times", 36.0))[int(rng.integers(4))]
    names = (("J_M", "J_L"), ("J_L",), ("J_M",))[int(rng.integers(2 if factor in (4.0, 36.0) else 3))]
    if rng.random() < 0.2:
        exchanged = {"J_M": BUS_NOMINAL["J_L"], "J_L": BUS_NOMINAL["J_M"]}
        return Drawn("J_M and J_L exchanged", "exchanged", nominal=exchanged)
    wrong = {name: factor * BUS_NOMINAL[name] for name in names}
    return Drawn(f"{' and '.join(names)} {unit}", "in the model file", nominal=wrong)


def judge(mistake: Drawn, folder: Path) -> tuple[str, str]:
    """Write the files, read them as a person would, paste the lines; return what came of it, and all that was said."""
    line = model({**BUS_NOMINAL, **(mistake.nominal or {})}, 0.2)
    signals = {**SIGNALS, **(mistake.signals or {})}
    paths = [folder / f"{name}.csv" for name in RECORDINGS]
    for path in paths:
        read = dict(driven(path.stem))
        columns = mistake.columns(read) if path.stem in mistake.recordings else read
        kept = ["t", "T1", "T2", "n", *(["P"] if "P" in columns else [])]
        path.write_text(csv({name: columns[name] for name in kept}), "utf-8")
    said, _ = _said_of(paths, signals, line)
    lines = pasted(said)
    if lines:
        for key, value in lines.items():
            signals = {name: each for name, each in signals.items() if not (key in OUTPUTS and name in OUTPUTS)}
            signals[key] = value
        _, records = _said_of(paths, signals, line)
        is_right = len(records) == len(paths) and all(is_true(record, driven(record.name), ROUGH) for record in records)
        return ("right" if is_right else "wrong"), said
    if not said:
        return "silent", said
    is_of = len(mistake.recordings) > 1 or mistake.recordings[0] in said
    if re.search(mistake.named, said) and is_of:
        return "named", said
    first = re.search(r"odds: ([^?(]*)", said)
    return ("something else" if first is not None and "something else" in first[1] else "another named"), said


def _said_of(paths: list[Path], signals: Mapping[str, Any], line: DrivelineModel) -> tuple[str, list[Record]]:
    said: list[str] = []
    config, records = SignalsConfig.model_validate(dict(signals)), []
    for path in paths:
        try:
            records.append(read_record(path, config, tell=said.append))
        except HilError as error:
            said.append(str(error))
    if records:
        tell_doubts(records, paths, line, config, None, said.append)
    return "\n".join(said), records


def main() -> int:
    """Print what comes of each, and how often; all that was said with ``--said``."""
    numbers = [int(each) for each in sys.argv[1:] if each.isdigit()]
    count, seed = [*numbers, *(60, 1)[len(numbers) :]]
    rng, counts = np.random.default_rng(seed), Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(count):
            mistake = drawn(rng)
            kind, said = judge(mistake, Path(folder))
            counts[kind] += 1
            print(f"{mistake.words:55} {kind}", flush=True)
            if "--said" in sys.argv[1:]:
                print("    " + said.replace("\n", "\n    "))
    print(f"\n{count} mistakes: " + ", ".join(f"{number} {kind}" for kind, number in counts.most_common()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
