"""The model behind the simulated rig, and the effects put into it; nothing that is compiled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from estimator.physics.model import DrivelineModel, Parameter, Structure
from hil.config.model_file import read_model
from hil.config.rig_file import SimulationTable
from hil.errors import ModelFileError, UsageError

DEFAULT_BUS = DrivelineModel(
    structure=Structure.TWO_MASS,
    parameters={
        "J_M": Parameter(1.6, 0.2),
        "J_L": Parameter(100.0, 0.2),
        "k": Parameter(4200.0, 0.2),
        "c": Parameter(9.0, 0.2),
        "b_M": Parameter(0.35, 0.2),
        "b_L": Parameter(0.9, 0.2),
    },
    gear_ratio=5.6,
)
"""A hybrid bus of 14 t, gear ratio 5.6, wheel radius 0.48 m, reflected to the motor shaft.

Assumed, for the paper gives no parameter values: first resonance 8.2 Hz, inside the 5 to 50 Hz band it names.
"""


@dataclass(frozen=True, slots=True)
class EffectSpec:
    """An effect put into the simulated rig: its name in the catalogue and the parameters given for it."""

    name: str
    parameters: Mapping[str, float]

    @classmethod
    def parse(cls, text: str) -> EffectSpec:
        """Read ``NAME[:k=v,...]``.

        Raises
        ------
        UsageError
            If there is no name, or a parameter is no ``key=number`` or comes twice.
        """
        name, _, rest = text.partition(":")
        if not name.strip():
            raise UsageError(f"effect {text!r}: expected NAME:key=number, got no name. List them by: hil effects")
        parameters: dict[str, float] = {}
        for part in rest.split(",") if rest else ():
            key, value = _parameter(text, part)
            if key in parameters:
                raise UsageError(f"effect {text!r}: expected {key!r} once, got twice. Leave one out.")
            parameters[key] = value
        return cls(name.strip(), parameters)


def simulation_model(table: SimulationTable, trust_laws: bool = False) -> DrivelineModel:
    """Model of the simulated driveline: the rig file's, or the default bus; its own laws run only where trusted."""
    if table.model is None:
        return DEFAULT_BUS
    file = read_model(table.model, trust_laws)
    if file.on_bench:
        raise ModelFileError(table.model, "structure | expected a driveline for a rig to drive | got 'joint'")
    return file.model


def _parameter(text: str, part: str) -> tuple[str, float]:
    key, _, value = part.partition("=")
    try:
        return key.strip(), float(value)
    except ValueError as error:
        raise UsageError(
            f"effect {text!r}: expected key=number, got {part!r}. Write NAME:key=number,key=number."
        ) from error
