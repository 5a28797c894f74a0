"""One run as a step orders it, and the rig file it is run with: the user's, with that one experiment and its PRBS.

The changed file is checked like any rig file, so that what an order asks for is held against the same limits; it is
what the recording is given to say of itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomlkit

from hil.config.experiment_tables import AnyExperiment
from hil.config.rig_file import Rig
from hil.errors import RigFileError
from hil.problems import validate
from hil.rig.addresses import with_addresses


@dataclass(frozen=True, slots=True)
class Order:
    """A run.

    Attributes
    ----------
    name
        Of the experiment in the changed rig file, and part of the recording's.
    table
        Its table in that file.
    prbs
        Keys of ``[prbs]`` that are other than the user's; None takes a key out.
    least_margin_rad_s
        How far the speed may leave its predicted range, at least.
    """

    name: str
    table: Mapping[str, Any]
    prbs: Mapping[str, Any] = field(default_factory=dict)
    least_margin_rad_s: float = 1.0

    @property
    def from_standstill(self) -> bool:
        """Whether it refuses a vehicle that moves."""
        return self.table["kind"] in ("pulses", "rest")


@dataclass(frozen=True, slots=True)
class RigSource:
    """The user's rig file, and the addresses that count in place of its own."""

    path: Path
    text: str
    bus: str | None = None
    modbus: str | None = None
    take_over: bool = False

    def rig(self) -> Rig:
        """Return the rig as the user wrote it.

        Raises
        ------
        RigFileError
            If the file has faults.
        """
        return self._checked(self.text)

    def ordered(self, order: Order) -> tuple[Rig, str]:
        """Return the rig to run an order with, and the text of its file.

        Raises
        ------
        RigFileError
            If the order breaks a rule of rig files: a limit, for one.
        """
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
    """Return an experiment of a rig file as a table to order, with changes."""
    return {**experiment.model_dump(), **changes}
