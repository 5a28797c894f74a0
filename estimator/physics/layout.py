"""How finely a line is integrated on a set of recordings, and where each parameter stands in the kernel's vector."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.errors import BadModel
from estimator.physics.catalogue import BUILT_IN, KERNEL
from estimator.physics.model import DrivelineModel, ExternalPlant, Load, Structure, natural_frequencies_rad_s
from estimator.physics.motion import reverses, speed_scale
from estimator.physics.own_law import Forces, LawName, OwnLaw
from estimator.signals.record import FloatArray, Record

RADIANS_PER_STEP = 0.2
"""Integration step in radians of the line's natural frequency, or its fastest decay. Fourth order would allow more; a
torque that steps within a step of the integration, as one delayed by a part of a period does, would not."""

FASTEST_IN_NYQUIST = 30.0
"""Fastest mode that is simulated, in multiples of the Nyquist frequency of the sample time.

A line that stiff differs from a rigid one by 1 / 30^2, a thousandth, at the highest frequency a recording holds:
simulating a faster mode takes ever more integration steps and changes nothing that can be seen.
"""

SIGN_WIDTH = 0.01
"""Dry friction changes sign within this share of the top speed of recordings that pass through standstill.

Real contacts give way a little before they slip; and a sharper edge makes the error a jagged function of the
parameters: on a real drive fits from different starts then ended up to 10 % apart in friction, with this width not.
"""

NOMINAL = Structure.THREE_MASS.parameter_names
"""The largest structure's parameters; a smaller structure leaves the rest at zero."""

LOAD = "load"
"""Name of the constant load torque that is not a recording's own, next to the nominal parameters; last of all, since no
kernel reads it (``inputs``)."""

OBSERVER = "observer"
"""Name of the share of the reading's error by which each sample corrects a simulation that follows the reading: 0 of a
free run, and of every model. A fit from afar begins with more and ends with none."""

_SLOTS: dict[tuple[str, str], int] = {}
for _name in NOMINAL:
    _SLOTS["", _name] = len(_SLOTS)
for _entry in KERNEL.values():
    for _parameter in _entry.parameters:
        _SLOTS[_entry.name, _parameter.name] = len(_SLOTS)
_SLOTS["", LOAD] = len(_SLOTS)
_SLOTS["", OBSERVER] = len(_SLOTS)

SIZE = len(_SLOTS)  # length of the flat vector, without a user's own laws


@dataclass(frozen=True, slots=True)
class Grid:
    """How a model is integrated on a set of recordings: sub-steps per period, width of a sign change, its own laws.

    One with a ``plant`` is simulated by that.
    """

    structure: Structure  # how many masses, or a joint
    substeps: int  # in a sampling period
    sign_width: float  # speed over which dry friction changes its sign [rad/s]
    laws: tuple[LawName, ...] = ()  # the user's, by name
    plant: ExternalPlant | None = None

    def active(self, p: FloatArray) -> list[LawName]:
        """Return the user's laws that a parameter vector switches on."""
        return [law for law in self.laws if law.is_active(p)]

    def acting(self, lines: Sequence[FloatArray]) -> list[LawName]:
        """Return those that any of some parameter vectors switches on."""
        return [law for law in self.laws if any(law.is_active(p) for p in lines)]

    def forces(self, laws: tuple[LawName, ...]) -> Forces:
        """Return some of the user's laws as one function; compiled where they are asked for first."""
        known = laws[0].compiled
        return known.setdefault(laws, Forces(laws)) if laws not in known else known[laws]


def substeps_for(values: Mapping[str, float], period_s: float) -> int:
    """Return the sub-steps of a sampling period that the fastest mode needs; BadModel if it can't be sampled."""
    if "J_M" not in values:
        return 1
    motor = (values["b_M"] + values.get("c", 0.0)) / values["J_M"]
    load = (values["b_L"] + values["c"]) / values["J_L"] if "k" in values else 0.0
    fastest = max(float(natural_frequencies_rad_s(values)[-1]), motor + load)
    if fastest * period_s > FASTEST_IN_NYQUIST * math.pi:
        raise BadModel(_too_fast(values, fastest, period_s))
    return max(1, math.ceil(fastest * period_s / RADIANS_PER_STEP))


def _too_fast(values: Mapping[str, float], fastest_rad_s: float, period_s: float) -> str:
    """Say which mode is too fast, and for which parameters to look: the largest part of it and what it acts on."""
    if natural_frequencies_rad_s(values)[-1] == fastest_rad_s:
        mode, law = "natural frequency", "k"
    else:
        parts = {"b_M": values["b_M"] / values["J_M"]}
        if "k" in values:
            parts |= {"b_L": values["b_L"] / values["J_L"], "c": values["c"] / min(values["J_M"], values["J_L"])}
        mode, law = "fastest decay", max(parts, key=parts.__getitem__)
    both = [name for name in ("J_M", "J_L") if name in values]
    inertia = {"b_M": "J_M", "b_L": "J_L"}.get(law) or min(both, key=values.__getitem__)
    return (
        f"parameters.{law} = {values[law]:g} with parameters.{inertia} = {values[inertia]:g}: the line's {mode} is "
        f"{fastest_rad_s / (2.0 * math.pi):.4g} Hz, expected at most {0.5 * FASTEST_IN_NYQUIST / period_s:.4g} Hz at "
        f"a sample time of {period_s:g} s ({FASTEST_IN_NYQUIST:g} times what it can show). Check both values and "
        "their units; a line that is rigid is structure = 'one_mass'."
    )


def grid_for(model: DrivelineModel, records: Sequence[Record]) -> Grid:
    """Choose the integration grid for a model on a set of recordings of one sampling period."""
    substeps = substeps_for(model.values(), records[0].sample_time_s)
    return Grid(model.structure, substeps, SIGN_WIDTH * _slow_scale(records), model.laws, model.plant)


def _slow_scale(records: Sequence[Record]) -> float:
    """Return the top speed of the recordings that reverse, or of all where none does [rad/s]."""
    return speed_scale([record for record in records if reverses(record)] or records)


def slot(effect: str, parameter: str) -> int:
    """Index of an effect's parameter; of a nominal one where ``effect`` is empty."""
    return effect.places[parameter] if isinstance(effect, LawName) else _SLOTS[effect, parameter]


def flat(model: DrivelineModel) -> FloatArray:
    """Return the kernel's parameter vector of a model: its values, every other effect at null."""
    nominal = model.values() if isinstance(model.load, Load) else {**model.values(), LOAD: model.load}
    effects = {name: {k: v.value for k, v in e.items()} for name, e in model.effects.items()}
    return flat_values(nominal, effects, model.laws)


def flat_values(
    nominal: Mapping[str, float], effects: Mapping[str, Mapping[str, float]], laws: Sequence[LawName] = ()
) -> FloatArray:
    """Return the same from plain values; ``laws`` are those of a user's own that the model has."""
    own: dict[str, LawName] = {name: name for name in laws}
    entries = [*KERNEL.values(), *(name.entry for name in laws)]
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
