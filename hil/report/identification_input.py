"""What an identification is given: order and delay chosen from the data, estimators by name, a file of before."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from estimator.errors import BadSetting
from estimator.identification.linear_model import Orders
from estimator.identification.offline.validation import OrderChoice, select_orders
from estimator.identification.online.adaptation import Adaptation
from estimator.identification.online.ekf import TwoMass
from estimator.identification.online.estimators import ESTIMATORS, Entry
from estimator.identification.settings import Settings
from estimator.physics.model import DrivelineModel, Structure
from estimator.signals.decimate import decimate
from estimator.signals.record import FloatArray, Record
from hil.errors import FileProblem, UsageError
from hil.files import read_json
from hil.problems import validate

AUTO: Final = "auto"

PHYSICAL: Final = "ekf"
"""The estimator whose states are physical parameters, which it can't start from nothing."""

ORDERS: Final = (2, 3, 4, 5, 6)
"""Tried for ``auto``: a two-mass drive has three."""

DELAYS: Final = (0, 1, 2, 3)
"""Tried for ``auto``. A low-pass ahead of the decimation spreads the torque over its neighbours to either side, so
that 0 may fit better than the one sample a held torque has."""

MOST_UNSEEN: Final = 3
"""Recordings the candidates are tried on besides the first, which they are fitted to."""


def chosen_orders(
    settings: Settings, order: str, delay: str, records: Sequence[Record]
) -> tuple[Settings, OrderChoice | None]:
    """Return the settings with order and delay filled in, and how they were chosen; None where both were given."""
    orders, delays = _numbers("--order", order, 1, ORDERS), _numbers("--delay", delay, 0, DELAYS)
    among = [Orders(n, n, nk) for nk in delays for n in orders]
    if len(among) == 1:
        return replace(settings, orders=among[0]), None
    first, *rest = (
        decimate(record, settings.factor(record), settings.high_pass_hz) for record in records[: MOST_UNSEEN + 1]
    )
    choice = select_orders(first, among, rest)
    return replace(settings, orders=choice.chosen), choice


def _numbers(option: str, text: str, least: int, all_of_them: Sequence[int]) -> Sequence[int]:
    if text == AUTO:
        return all_of_them
    if not (text.isascii() and text.isdigit()) or int(text) < least:
        raise UsageError(f"{option}: expected a whole number from {least} on, or {AUTO}, got {text!r}")
    return (int(text),)


def chosen_estimators(names: Sequence[str]) -> Mapping[str, Entry]:
    """Return what makes the recursive estimators of these names, each once."""
    for name in names:
        if name not in ESTIMATORS:
            raise UsageError(f"--estimator: expected one of {', '.join(ESTIMATORS)}, got {name!r}")
    return {name: ESTIMATORS[name] for name in names}


def start_values(names: Sequence[str], expected: DrivelineModel | None) -> TwoMass | None:
    """Return the start values for an estimator of physical parameters: those of a two-mass model file."""
    if expected is not None and expected.structure is Structure.TWO_MASS:
        return TwoMass(**expected.values())
    if PHYSICAL in names:
        raise UsageError(
            f"--estimator {PHYSICAL}: expected start values for J_M, J_L, k and c, got none. Give a two-mass model "
            "file by --model; a factor of two off is near enough."
        )
    return None


class _Part(BaseModel):
    """A part of the file; the file has more than is read here."""

    model_config = ConfigDict(strict=True, frozen=True, extra="ignore")


class _Settings(_Part):
    na: int
    nb: int
    nk: int
    sample_time_s: float
    high_pass_hz: float


class _Recording(_Part):
    name: str
    output: str
    filter_L: list[float] = Field(min_length=1)  # noqa: N815 - the file's own key


class IdentificationFile(_Part):
    """The file: settings, and for each recording its observation filter."""

    schema_name: Literal["hil.identification/1"] = Field(alias="schema")
    settings: _Settings  # of all recordings
    recordings: list[_Recording] = Field(min_length=1)  # in their order


def read_identification(path: Path) -> IdentificationFile:
    """Read one file."""
    return validate(IdentificationFile, json_object(path), path, FileProblem)


@dataclass(frozen=True, slots=True, eq=False)
class Identified:
    """A recording that was identified, as an estimator needs it."""

    name: str  # of the recording
    settings: Settings  # orders, delay, period and high-pass it was identified with
    L: FloatArray  # (m,): Observation filter's denominator


def identified(path: Path, run: str | None, adaptation: Adaptation, option: str = "--run") -> Identified:
    """Return the settings that identified a recording, and its observation filter L, as the paper reuses them."""
    file = read_identification(path)
    entry = _chosen(path, file.recordings, run, option)
    if entry.output != "speed":
        raise FileProblem(path, f"recordings.{entry.name}.output | expected 'speed' | got {entry.output!r}")
    return Identified(entry.name, _settings(path, file.settings, adaptation), np.array(entry.filter_L))


def _settings(path: Path, given: _Settings, adaptation: Adaptation) -> Settings:
    try:
        return Settings(
            orders=Orders(given.na, given.nb, given.nk),
            sample_time_s=given.sample_time_s,
            high_pass_hz=given.high_pass_hz,
            adaptation=adaptation,
        )
    except BadSetting as cause:
        raise FileProblem(path, f"settings | {cause}") from cause


def _chosen(path: Path, entries: Sequence[_Recording], run: str | None, option: str) -> _Recording:
    names = ", ".join(entry.name for entry in entries)
    if run is None and len(entries) > 1:
        raise UsageError(f"{path}: it holds {len(entries)} recordings, expected one named by {option}: {names}")
    for entry in entries:
        if run in (None, entry.name):
            return entry
    raise UsageError(f"{option} {run}: expected a recording of {path}: {names}")


def json_object(path: Path) -> dict[str, Any]:
    """Read a file of the program's own."""
    try:
        found = read_json(path)
    except OSError as cause:
        raise FileProblem(path, f"the file | expected identification.json | got: {cause.strerror}") from cause
    except UnicodeDecodeError as cause:
        raise FileProblem(path, f"the file | expected UTF-8 text | got: {cause.reason}") from cause
    except json.JSONDecodeError as cause:
        raise FileProblem(path, f"line {cause.lineno} | expected JSON | got: {cause.msg}") from cause
    except ValueError as cause:
        raise FileProblem(path, f"the file | expected JSON | got: {cause}") from cause
    if not isinstance(found, dict):
        raise FileProblem(path, f"the file | expected a JSON object | got a {type(found).__name__}")
    return found


@dataclass(frozen=True, slots=True)
class PhysicalValue:
    """A physical parameter that a recording determines, with the half width of its 95 % interval."""

    value: float  # in the unit of identification.json, SI
    half_width: float  # in the same unit
    recording: str  # name of the one it is from


def physical_values(path: Path, run: str | None = None) -> dict[str, PhysicalValue]:
    """Return the physical parameters of ``identification.json``: of one recording, or the surest of all."""
    read_identification(path)  # says what is wrong with it
    entries = [each for each in json_object(path)["recordings"] if run in (None, each["name"])]
    if not entries:
        raise UsageError(f"{path}: expected a recording {run!r} in it, got a file without. See --run.")
    best: dict[str, PhysicalValue] = {}
    for entry in entries:
        for name, one in table(table(entry, "physical"), "parameters").items():
            found = physical_value(one, str(entry["name"]))
            if found is not None and (name not in best or found.half_width < best[name].half_width):
                best[name] = found
    return best


def table(of: Mapping[str, Any], key: str) -> dict[str, Any]:
    """Return what is a table under a key; an empty one for all else."""
    found = of.get(key)
    return found if isinstance(found, dict) else {}


def physical_value(one: Any, recording: str) -> PhysicalValue | None:
    """Return a value that is determined; None for any other."""
    match one:
        case {
            "determined": True,
            "value": int() | float() as value,
            "ci95": [int() | float() as low, int() | float() as high],
        } if np.isfinite((value, low, high)).all():
            return PhysicalValue(float(value), 0.5 * float(high - low), recording)
    return None
