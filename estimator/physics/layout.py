"""Where each parameter of the superset model stands in the kernel's flat vector."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from estimator.physics.catalogue import BUILT_IN, EFFECTS
from estimator.physics.effect import Effect
from estimator.physics.model import DrivelineModel, Load, Structure
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
"""Name of the constant load torque that is not a recording's own, beside the nominal parameters; last of all, since no
kernel reads it (``inputs``)."""

_SLOTS["", LOAD] = len(_SLOTS)

SIZE = len(_SLOTS)
"""Length of the flat vector, without a user's own laws."""

_OWN_SLOTS: dict[tuple[str, str], int] = {}


def add(entries: Sequence[Effect]) -> None:
    """Place the parameters of these behind all others, in place of those before (``own_law.install``)."""
    _OWN_SLOTS.clear()
    for entry in entries:
        for parameter in entry.parameters:
            _OWN_SLOTS[entry.name, parameter.name] = SIZE + len(_OWN_SLOTS)


def slot(effect: str, parameter: str) -> int:
    """Index of an effect's parameter; of a nominal one where ``effect`` is empty."""
    key = effect, parameter
    return _SLOTS[key] if key in _SLOTS else _OWN_SLOTS[key]


def flat(model: DrivelineModel) -> FloatArray:
    """Return the kernel's parameter vector of a model, shape (SIZE,): its values, every other effect at null."""
    nominal = model.values() if isinstance(model.load, Load) else {**model.values(), LOAD: model.load}
    return flat_values(nominal, {name: {k: v.value for k, v in e.items()} for name, e in model.effects.items()})


def flat_values(nominal: Mapping[str, float], effects: Mapping[str, Mapping[str, float]]) -> FloatArray:
    """Return the kernel's parameter vector from plain values, shape (SIZE,)."""
    vector = np.zeros(SIZE + len(_OWN_SLOTS))
    for entry in EFFECTS.values():
        for parameter in entry.parameters:
            vector[slot(entry.name, parameter.name)] = parameter.null
    for name, value in nominal.items():
        vector[slot("", name)] = value
    for effect, values in effects.items():
        for name, value in values.items():
            vector[slot(effect, name)] = value
    return vector
