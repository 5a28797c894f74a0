"""One run as a step orders it, with the rig file it is run with, and what was changed in that file."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import tomlkit

from hil.config.experiment_tables import AnyExperiment, CruiseTable
from hil.config.rig_file import Rig
from hil.errors import RigFileError, UsageError
from hil.problems import validate
from hil.simulator.addresses import with_addresses

HALT_S = 1.0
"""Recorded part of coming to a stand [s]."""

OWN_EXCITATION = frozenset({"prbs_amplitude_nm", "prbs_clock_divider", "multisine"})
"""Keys by which an experiment is excited otherwise than [prbs] says."""


@dataclass(frozen=True, slots=True)
class Order:
    """A run."""

    name: str  # Of the experiment in the changed rig file, and part of the recording's
    table: Mapping[str, Any]  # Its table in that file
    prbs: Mapping[str, Any] = field(default_factory=dict)  # keys of [prbs] that change; None takes a key out
    least_margin_rad_s: float = 1.0  # How far the speed may leave its predicted range, at least

    @property
    def from_standstill(self) -> bool:
        """Whether it refuses a vehicle that moves."""
        return self.table["kind"] in ("pulses", "rest")


@dataclass(frozen=True, slots=True)
class RigSource:
    """The user's rig file, and the addresses that count in place of its own."""

    path: Path  # for messages, and what its paths are relative to
    text: str  # as it was read
    bus: str | None = None  # address in place of that of [can]; None: the file's
    modbus: str | None = None  # HOST:PORT in place of that of [plc]; None: the file's
    take_over: bool = False  # whether another host may be on the bus (`hil.rig.sole_host`)

    def rig(self) -> Rig:
        """Return the rig at the addresses that count; `RigFileError` where the file is wrong."""
        return self._checked(self.text)

    def ordered(self, order: Order) -> tuple[Rig, str]:
        """Return the rig to run an order with, and the text of its file."""
        document = tomlkit.parse(self.text)
        document["experiments"] = {order.name: dict(order.table)}
        prbs: Any = document["prbs"]
        for key, value in order.prbs.items():
            if value is None:
                prbs.pop(key, None)
            else:
                prbs[key] = value
        text = tomlkit.dumps(document)
        return self._checked(text), text

    def _checked(self, text: str) -> Rig:
        rig = validate(Rig, tomlkit.parse(text).unwrap(), self.path, RigFileError)
        return with_addresses(rig, self.bus, self.modbus, self.take_over)


def as_table(experiment: AnyExperiment, **changes: object) -> dict[str, Any]:
    """Return an experiment of a rig file as a table to order, with changes.

    Where ``prbs`` is among them the order says what excites, by [prbs]: what the experiment has of its own goes.
    """
    own = OWN_EXCITATION if "prbs" in changes else frozenset()
    return {**experiment.model_dump(mode="json", exclude_none=True, exclude=set(own)), **changes}


def rig_digest(text: str) -> str:
    """Return the SHA-256 of what a rig file says, hexadecimal; comments and layout do not count."""
    return hashlib.sha256(json.dumps(tomllib.loads(text), sort_keys=True, default=str).encode()).hexdigest()


def changed_keys(before: str, after: str) -> list[str]:
    """Name the keys that differ, each with its old and its new value."""
    old, new = (dict(_leaves(tomllib.loads(text))) for text in (before, after))
    return [
        f"{key}: {_shown(old, key)} → {_shown(new, key)}"
        for key in dict.fromkeys((*old, *new))
        if old.get(key) != new.get(key)
    ]


def _leaves(table: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _shown(leaves: dict[str, Any], key: str) -> str:
    return repr(leaves[key]) if key in leaves else "not there"


ExperimentKind = TypeVar("ExperimentKind", bound=AnyExperiment)


def first_of(rig: Rig, kind: type[ExperimentKind]) -> ExperimentKind | None:
    """Return the first experiment of a kind in a rig file; None without one."""
    return next((table for table in rig.experiments.values() if isinstance(table, kind)), None)


def cruise_of(rig: Rig) -> CruiseTable:
    """Return the cruise of a rig file: its speed is the one the vehicle is commissioned at."""
    table = first_of(rig, CruiseTable)
    if table is None:
        raise UsageError(
            f"rig {rig.name!r}: expected an experiment of kind 'cruise', which says at what speed and torque the "
            "vehicle may be driven, there is none. Add [experiments.cruise] to the rig file; see examples/rig.toml."
        )
    return table


def halt(rig: Rig) -> Order:
    """Order the vehicle to a stand, by the torque that brought it to speed."""
    table = as_table(cruise_of(rig), speed_rad_s=0.0, duration_s=HALT_S, prbs=False)
    return Order("halt", table, least_margin_rad_s=2.0)
