"""Which plant stands behind the simulated rig: the one place that chooses it from the rig file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Effect, Element
from estimator.physics.model import DrivelineModel, EffectValue, Motion
from hil.config.rig_file import Rig
from hil.errors import UsageError
from hil.simulator.driveline_plant import DrivelinePlant
from hil.simulator.effect_bounds import out_of_bounds
from hil.simulator.plant import Plant
from hil.simulator.rig_server import required_simulation
from hil.simulator.simulation_model import EffectSpec, simulation_model


def plant_for(rig: Rig, effects: Sequence[EffectSpec] = (), trust_laws: bool = False) -> Plant:
    """Build the driveline of a rig file.

    Parameters
    ----------
    rig
        The rig file, with a table ``[simulation]``.
    effects
        Effects put in on top of those of its model, or in place of one of the same name; each once.
    trust_laws
        Whether the code of its model's own laws may run.

    Raises
    ------
    UsageError
        If the rig file has no ``[simulation]``, its model is of a translation, or an effect comes twice,
        without any parameter, with one outside the catalogue's bounds, or as a profile over time.
    BadModel
        If an effect is none of the catalogue, lacks a parameter or has another, or the line has a mode too fast to
        simulate at the rig's period.
    """
    model = simulation_model(required_simulation(rig), trust_laws)
    if model.motion is not Motion.ROTATION:
        raise UsageError(
            f"rig {rig.name!r}, simulation.model: expected motion = 'rotation', got {model.motion.value!r}: "
            "its inverters turn a shaft. Name another model."
        )
    names = [effect.name for effect in effects]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise UsageError(f"effect {twice[0]!r}: expected once, got twice. Give all its parameters in one --effect.")
    for effect in effects:
        _require_parameters(effect)
    changed = replace(model, effects={**model.effects, **{effect.name: _values(effect) for effect in effects}})
    _refuse_absent(changed)
    faults = [fault for effect in effects for fault in out_of_bounds(rig, changed, effect.name, effect.parameters)]
    if faults:
        raise UsageError("\n".join(f"{fault}. Check its unit: hil effects NAME has the law." for fault in faults))
    return DrivelinePlant(changed, rig.period_s)


def _values(effect: EffectSpec) -> dict[str, EffectValue]:
    entry = EFFECTS.get(effect.name)
    parameters = effect.parameters if entry is None else entry.completed(effect.parameters)
    return {key: EffectValue(value) for key, value in parameters.items()}


def _require_parameters(effect: EffectSpec) -> None:
    entry = EFFECTS.get(effect.name)
    if entry is None or effect.parameters:
        return
    known = ", ".join(parameter.name for parameter in entry.parameters)
    raise UsageError(
        f"effect {effect.name!r}: expected at least one of its parameters ({known}), got none, which does "
        f"nothing. Write {effect.name}:{entry.parameters[0].name}=..."
    )


def _refuse_absent(model: DrivelineModel) -> None:
    """Refuse what this plant has no place for: a course over time, an acquisition, an event without moments."""
    for name, values in model.effects.items():
        if reason := _reason_absent(EFFECTS[name], values):
            raise UsageError(
                f"effect {name!r}: {reason}. Take it out of --effect, or [effects.{name}] out of simulation.model. A "
                f"recording that has it: python -m hil.proof.make_case --effect {name} --seed 1 --out DIR"
            )


def _reason_absent(entry: Effect, values: Mapping[str, EffectValue]) -> str:
    if entry.profile:
        return (
            "expected an effect with a constant law, got one that is a profile over each recording's own time "
            f"({entry.law}): the simulated rig would drive without it"
        )
    if entry.element is Element.ACQUISITION:
        return "expected an effect of the driveline or its sensor, got one of the acquisition (see --fault)"
    if entry.event and not {"from_s", "to_s"} <= set(values):
        return "expected from_s and to_s too, the moments between which it acts, got none"
    return ""
