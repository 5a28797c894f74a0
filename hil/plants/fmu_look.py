"""Which variables of an FMU could be what ``--map`` names, by causality, unit and name; nothing of it runs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from hil.errors import UsageError
from hil.plants.fmu_process import STEP_S
from hil.printable import printable
from hil.recording.sandbox import Document, Gone, Sandbox

AT_LOAD: Final = r"load|wheel|road|brake|dist|vehicle|abtrieb|last"

_SPEED, _TORQUE = ("rad/s", "rad.s-1", "1/s", "rpm", "1/min"), ("N.m", "Nm", "N*m", "N m")


@dataclass(frozen=True, slots=True)
class _Looks:
    """What a variable looks like that is meant by a key."""

    causality: str
    units: tuple[str, ...]
    name: str
    at_load: bool
    several: bool = False


_BY_KEY: Final = {
    "torque": _Looks("input", _TORQUE, r"torque|tau|^T(_|\d|$)|moment|^M(_|\d|$)", False, True),
    "output": _Looks("output", _SPEED, r"speed|omega|^w(_|\d|$)|^n(_|\d|$)|dphi|der\(", False),
    "load": _Looks("input", _TORQUE, r"load|road|dist", True),
    "load_speed": _Looks("output", _SPEED, r"speed|omega|^w(_|\d|$)|^n(_|\d|$)|dphi|der\(", True),
    "start": _Looks("parameter", _SPEED, r"start|init|_0$|0$", False, True),
}


@dataclass(frozen=True, slots=True)
class FmuLook:
    """What is in an FMU."""

    variables: Sequence[Mapping[str, Any]]  # name, causality, variability, type and unit of each
    mapped: Mapping[str, tuple[str, ...]]  # by key of ``--map``, what is meant most probably
    doubtful: Mapping[str, tuple[str, ...]]  # by key, what could be meant as well

    @property
    def options(self) -> str:
        """Return the options to paste."""
        return " ".join(f"--map {key}={','.join(names)}" for key, names in self.mapped.items() if names)


def look_into(path: Path) -> FmuLook:
    """Read what an FMU says of itself."""
    shown = [each for each in _variables(path) if each["causality"] in ("input", "output", "parameter")]
    mapped: dict[str, tuple[str, ...]] = {}
    doubtful: dict[str, tuple[str, ...]] = {}
    for key, looks in _BY_KEY.items():
        scored = [(_score(each, looks), str(each["name"])) for each in shown]
        best = max((score for score, _ in scored), default=0)
        found = tuple(name for score, name in scored if score == best and score > 0)
        mapped[key] = found if looks.several else found[:1]
        others = tuple(name for score, name in scored if score > 0 and name not in mapped[key])
        doubtful[key] = others if not looks.several else ()
    return FmuLook(shown, mapped, doubtful)


def _variables(path: Path) -> list[Document]:
    sandbox = Sandbox("hil.plants.fmu_process")
    try:
        said = sandbox.ask({"what": "open", "path": str(path.absolute())}, STEP_S)[0]
    except Gone:
        said = {"problem": "one that ends its reader"}
    finally:
        sandbox.end()
    if "problem" in said:
        raise UsageError(f"{path}: expected an FMU of FMI 1.0, 2.0 or 3.0, got: {printable(str(said['problem']))}")
    variables: list[Document] = said["variables"]
    return variables


def _score(variable: Mapping[str, Any], looks: _Looks) -> int:
    """Return how much a variable looks like what is meant; 0 where it can't be."""
    name, unit = str(variable["name"]), str(variable["unit"])
    at_load = re.search(AT_LOAD, name, re.IGNORECASE) is not None
    if variable["causality"] != looks.causality or at_load != looks.at_load or (unit and unit not in looks.units):
        return 0
    return 2 * bool(unit) + bool(re.search(looks.name, name, re.IGNORECASE))
