"""A plant: it simulates a recording from its torques, with what is the recording's own estimated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from estimator.diagnosis.acquisition.chain import replay
from estimator.physics.free_run import NOTHING_KNOWN, FreeRun, Own
from estimator.physics.model import DrivelineModel, Motion
from estimator.signals.record import Record

Events = Mapping[str, Own]


class Plant(Protocol):
    """Something that simulates recordings."""

    @property
    def name(self) -> str:
        """What it is called in figures and tables."""

    @property
    def motion(self) -> Motion:
        """Kind of motion, for the units."""

    def run(self, record: Record) -> FreeRun:
        """Simulate a recording from its torques, nothing fed back."""


@dataclass(frozen=True, slots=True)
class ModelPlant:
    """The model of a model file."""

    name: str  # of the model file, or what its caller calls it
    model: DrivelineModel  # with its effects
    events: Events = field(default_factory=dict)  # by name of the recording, what a diagnosis found of its own in it

    @property
    def motion(self) -> Motion:
        """Kind of motion, for the units."""
        return self.model.motion

    def run(self, record: Record) -> FreeRun:
        """Simulate a recording; constant load torque and initial state are estimated."""
        return replay(self.model, record, self.events.get(record.name, NOTHING_KNOWN))


@dataclass(frozen=True, slots=True)
class Trust:
    """What code may run: that of a model file's own laws, and that in an FMU."""

    laws: bool = False  # --trust-laws
    fmu: bool = False  # --trust-fmu
