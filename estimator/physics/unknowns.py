"""What a fit may change: shared parameters of the superset model, and what every recording has of its own.

The vector of unknowns is ``[shared ..., local of record 0 ..., local of record 1 ...]``, all scaled to order one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import EffectParameter, Held
from estimator.physics.effects import road_grade
from estimator.physics.layout import slot
from estimator.physics.model import DrivelineModel, Structure
from estimator.physics.motion import measured_speed, speed_scale, torque_scale
from estimator.physics.simulate import Start, natural_frequency_rad_s
from estimator.signals.record import FloatArray, OutputKind, Record


@dataclass(frozen=True, slots=True)
class Shared:
    """A parameter common to all recordings: ``value = scale * x`` with ``low <= x <= high``.

    ``effect`` is empty for a nominal parameter.
    """

    effect: str
    name: str
    scale: float
    low: float
    high: float
    start: float

    @property
    def slot(self) -> int:
        """Its place in the kernel's parameter vector."""
        return slot(self.effect, self.name)


def nominal_unknowns(model: DrivelineModel) -> tuple[Shared, ...]:
    """Return the nominal parameters as unknowns within their tolerances; one trusted exactly is not free."""
    return tuple(
        Shared("", name, p.value, 1.0 - p.tolerance, 1.0 + p.tolerance, 1.0)
        for name, p in model.parameters.items()
        if p.tolerance > 0 and p.value > 0
    )


def effect_unknowns(name: str, model: DrivelineModel, records: Sequence[Record]) -> list[tuple[Shared, ...]]:
    """Return an effect's parameters as unknowns, once per start point; a profile has no shared ones."""
    entry = EFFECTS[name]
    if entry.profile:
        return [()]
    scales = entry.scales(model, records)
    return [
        tuple(
            _unknown(name, parameter, scale, x)
            for parameter, scale, x in zip(entry.shared_parameters, scales, start, strict=True)
        )
        for start in entry.starts(model, records)
    ]


def _unknown(effect: str, parameter: EffectParameter, scale: float, x: float | Held) -> Shared:
    if isinstance(x, Held):
        return Shared(effect, parameter.name, scale, x.value, x.value, x.value)
    return Shared(effect, parameter.name, scale, parameter.low, parameter.high, x)


LOAD_TORQUE = 0
"""Where the constant load torque stands among a recording's own unknowns."""


@dataclass(frozen=True, slots=True)
class LocalBasis:
    """The unknowns of one recording: load torque, initial state and, where asked, a load profile.

    Attributes
    ----------
    scale : ndarray, shape (L,)
        Size of each unknown, in its unit.
    guess : ndarray, shape (L,)
        Where a fit starts, in units of ``scale``.
    profile : ndarray, shape (K, N)
        Basis of the load profile; K = 0 without one.
    """

    structure: Structure
    has_angle: bool
    scale: FloatArray
    guess: FloatArray
    profile: FloatArray

    def start(self, x: FloatArray) -> Start:
        """Return the start state of scaled unknowns ``x``, shape (L,)."""
        values = x * self.scale
        angle = float(values[2]) if self.has_angle else 0.0
        i = self.twist_index
        if i is None:
            return Start(float(values[0]), angle, float(values[1]))
        return Start(float(values[0]), angle, float(values[1]), float(values[i]), float(values[i + 1]))

    @property
    def twist_index(self) -> int | None:
        """Where the initial twist stands among the unknowns; None for one mass."""
        if self.structure is Structure.ONE_MASS:
            return None
        return 3 if self.has_angle else 2

    def extra_load(self, x: FloatArray) -> FloatArray | None:
        """Return the load profile of scaled unknowns, shape (N,) [Nm]; None without one."""
        count = self.profile.shape[0]
        if count == 0:
            return None
        load: FloatArray = (x[-count:] * self.scale[-count:]) @ self.profile
        return load


def local_basis(model: DrivelineModel, record: Record, profile: bool) -> LocalBasis:
    """Set up the unknowns of one recording, with a start read off its first samples."""
    speed = measured_speed(record)
    v_scale, t_scale = speed_scale([record]), torque_scale([record])
    first = speed[np.flatnonzero(np.isfinite(speed))[:3]].mean()
    load = _mean_load(model, record, speed)
    has_angle = record.kind is OutputKind.POSITION
    scale, guess = [0.1 * t_scale, 0.1 * v_scale], [load, first]
    if has_angle:
        y = record.output[record.okay]
        scale.append(max(0.01 * float(np.ptp(y)), np.finfo(float).tiny))
        guess.append(float(y[0]))
    if model.structure is Structure.TWO_MASS:
        values = model.values()
        swing = t_scale / (values["J_M"] * natural_frequency_rad_s(values))
        scale += [0.1 * t_scale / values["k"], 0.1 * swing]
        guess += [load / values["k"], first]
    shape = road_grade.basis(record.time_s) if profile else np.empty((0, record.time_s.size))
    count = shape.shape[0]
    all_scales = np.array(scale + [0.05 * t_scale] * count)
    return LocalBasis(model.structure, has_angle, all_scales, np.array(guess + [0.0] * count) / all_scales, shape)


def _mean_load(model: DrivelineModel, record: Record, speed: FloatArray) -> float:
    """Return the mean torque left after viscous friction and acceleration of the whole line [Nm]."""
    values = model.values()
    inertia = values["J_M"] + values.get("J_L", 0.0)
    viscous = values["b_M"] + values.get("b_L", 0.0)
    good = np.flatnonzero(np.isfinite(speed))
    duration = record.time_s[good[-1]] - record.time_s[good[0]]
    n = max(1, good.size // 50)
    acceleration = (speed[good[-n:]].mean() - speed[good[:n]].mean()) / duration
    return float(record.total_torque_nm.mean() - viscous * np.nanmean(speed) - inertia * acceleration)
