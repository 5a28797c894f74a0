"""Where each parameter of the superset model stands in the kernel's flat vector."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimator.errors import BadModel
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.model import DrivelineModel, Load, Structure
from estimator.physics.own_law import LawName, OwnLaw
from estimator.signals.record import FloatArray

NOMINAL = Structure.THREE_MASS.parameter_names
"""The largest structure's parameters; a smaller structure leaves the rest at zero."""

_SLOTS: dict[tuple[str, str], int] = {}
for _name in NOMINAL:
    _SLOTS["", _name] = len(_SLOTS)
for _entry in BUILT_IN.values():
    for _parameter in _entry.parameters:
        _SLOTS[_entry.name, _parameter.name] = len(_SLOTS)

LOAD = "load"
"""Name of the constant load torque that is not a recording's own, next to the nominal parameters; last of all, since no
kernel reads it (``inputs``)."""

_SLOTS["", LOAD] = len(_SLOTS)

SIZE = len(_SLOTS)
"""Length of the flat vector, without a user's own laws."""


def slot(effect: str, parameter: str) -> int:
    """Index of an effect's parameter; of a nominal one where ``effect`` is empty."""
    return effect.places[parameter] if isinstance(effect, LawName) else _SLOTS[effect, parameter]


def flat(model: DrivelineModel) -> FloatArray:
    """Return the kernel's parameter vector of a model: its values, every other effect at null.

    Shape (SIZE,), and more where the model has laws of a user's own.
    """
    nominal = model.values() if isinstance(model.load, Load) else {**model.values(), LOAD: model.load}
    effects = {name: {k: v.value for k, v in e.items()} for name, e in model.effects.items()}
    return flat_values(nominal, effects, model.laws)


def flat_values(
    nominal: Mapping[str, float], effects: Mapping[str, Mapping[str, float]], laws: Sequence[LawName] = ()
) -> FloatArray:
    """Return the same from plain values; ``laws`` are those of a user's own that the model has."""
    own: dict[str, LawName] = {name: name for name in laws}
    entries = [*BUILT_IN.values(), *(name.entry for name in laws)]
    vector = np.zeros(SIZE + sum(len(name.places) for name in laws))
    for entry in entries:
        for parameter in entry.parameters:
            vector[slot(entry.name, parameter.name)] = parameter.null
    for name, value in nominal.items():
        vector[slot("", name)] = value
    for effect, values in effects.items():
        for name, value in values.items():
            vector[slot(own.get(effect, effect), name)] = value
    return vector


def named(laws: Sequence[OwnLaw]) -> tuple[LawName, ...]:
    """Return the names of the laws of one model, which know the laws and their places in its parameter vector."""
    names = [law.name for law in laws]
    taken = [name for name in names if name in BUILT_IN or names.count(name) > 1]
    if taken:
        raise BadModel(f"laws.{taken[0]}: expected a name that is not in the catalogue and comes once. Rename it.")
    found, size = [], SIZE
    for law in laws:
        name = LawName(law.name)
        name.law, name.entry = law, replace(law.effect(), name=name)
        name.compiled = {}
        name.places = {each.name: size + i for i, each in enumerate(law.parameters)}
        size += len(law.parameters)
        found.append(name)
    return tuple(found)
