"""Which plant stands behind the simulated rig: the one place that chooses it from the rig file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from estimator.physics.catalogue import EFFECTS
from estimator.physics.model import DrivelineModel, EffectValue, Motion
from hil.config.rig_file import Rig
from hil.errors import UsageError
from hil.simulator.driveline_plant import DrivelinePlant
from hil.simulator.plant import Plant
from hil.simulator.rig_server import required_simulation
from hil.simulator.simulation_model import EffectSpec, simulation_model


def plant_for(rig: Rig, effects: Sequence[EffectSpec] = ()) -> Plant:
    """Build the driveline of a rig file.

    Parameters
    ----------
    rig
        The rig file, with a table ``[simulation]``.
    effects
        Effects put in on top of those of its model, or in place of one of the same name; each once.

    Raises
    ------
    UsageError
        If the rig file has no ``[simulation]``, its model is of a translation, or an effect comes twice or
        without any parameter.
    BadModel
        If an effect is none of the catalogue, or has no such parameter.
    """
    model = simulation_model(required_simulation(rig))
    if model.motion is not Motion.ROTATION:
        raise UsageError(
            f"rig {rig.name!r}, simulation.model: expected motion = 'rotation', came {model.motion.value!r}: "
            "its inverters turn a shaft. Name another model."
        )
    names = [effect.name for effect in effects]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise UsageError(f"effect {twice[0]!r}: expected once, came twice. Give all its parameters in one --effect.")
    return DrivelinePlant(_with(model, effects), rig.period_s)


def _with(model: DrivelineModel, effects: Sequence[EffectSpec]) -> DrivelineModel:
    return replace(model, effects={**model.effects, **{effect.name: _values(effect) for effect in effects}})


def _values(effect: EffectSpec) -> dict[str, EffectValue]:
    """Take the parameters given; those left out are at their null, where they do nothing."""
    entry = EFFECTS.get(effect.name)
    if entry is not None and not effect.parameters:
        known = ", ".join(parameter.name for parameter in entry.parameters)
        raise UsageError(
            f"effect {effect.name!r}: expected at least one of its parameters ({known}), came none, which does "
            f"nothing. Write {effect.name}:{entry.parameters[0].name}=..."
        )
    nulls = {} if entry is None else {parameter.name: parameter.null for parameter in entry.parameters}
    return {key: EffectValue(value) for key, value in {**nulls, **effect.parameters}.items()}
