"""What a fit may change: shared parameters of the superset model, and what every recording has of its own.

The vector of unknowns is ``[shared ..., local of record 0 ..., local of record 1 ...]``, all scaled to order one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.physics import effect
from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Effect, EffectParameter, Held, Within
from estimator.physics.effects.load import grade_basis
from estimator.physics.layout import LOAD, slot
from estimator.physics.model import (
    STRICTLY_POSITIVE,
    DrivelineModel,
    Parameter,
    Structure,
    natural_frequencies_rad_s,
)
from estimator.physics.motion import measured_speed, motor_angle, speed_scale, torque_scale
from estimator.signals.record import FloatArray, OutputKind, Record

LOAD_TORQUE, TWIST, PRELOAD = 0, 1, 2
"""Where the constant load torque stands among a recording's own unknowns; a joint's twist at the start, and preload."""


@dataclass(frozen=True, slots=True)
class Shared:
    """A parameter common to all recordings: ``value = scale * x`` with ``low <= x <= high``.

    ``effect`` is empty for a nominal parameter.
    """

    effect: str
    name: str  # of the parameter
    scale: float  # in the parameter's unit
    low: float  # smallest x
    high: float  # largest x
    start: float  # x where the fit starts

    @property
    def slot(self) -> int:
        """Its place in the kernel's parameter vector."""
        return slot(self.effect, self.name)


def nominal_unknowns(model: DrivelineModel) -> tuple[Shared, ...]:
    """Return the nominal parameters as unknowns within what they are trusted to; one trusted exactly is not free."""
    return (*filter(None, (_nominal(name, p) for name, p in model.parameters.items())), *_known_roughly(model))


def _nominal(name: str, parameter: Parameter) -> Shared | None:
    """Return a nominal parameter in units of its value; of the end of its interval where the value is 0."""
    if parameter.ci95 is None:
        sure = parameter.tolerance == 0.0 or parameter.value == 0.0
        return (
            None
            if sure
            else Shared("", name, parameter.value, 1.0 - parameter.tolerance, 1.0 + parameter.tolerance, 1.0)
        )
    low, high = parameter.bounds(may_be_zero=name not in STRICTLY_POSITIVE)
    if low == high:
        return None
    scale = parameter.value or parameter.high
    return Shared("", name, scale, low / scale, high / scale, parameter.value / scale)


def _known_roughly(model: DrivelineModel) -> Iterable[Shared]:
    """Yield the parameters of the model's own effects that may be re-tuned, within what their laws allow."""
    for name, values in model.effects.items():
        for parameter in EFFECTS[name].shared_parameters:
            given = values.get(parameter.name)
            if given is not None and given.tolerance > 0:
                high = min(1.0 + given.tolerance, max(parameter.most / abs(given.value), 1.0))
                yield Shared(name, parameter.name, given.value, 1.0 - given.tolerance, high, 1.0)


@dataclass(frozen=True, slots=True)
class Release:
    """One start point of one effect: what all recordings share, and what each has of its own."""

    shared: tuple[Shared, ...]  # unknowns of all recordings
    own: tuple[tuple[Shared, ...], ...]  # unknowns of each recording


def effect_unknowns(name: str, model: DrivelineModel, records: Sequence[Record]) -> list[Release]:
    """Return an effect's parameters as unknowns, once per start point; a profile has no shared ones."""
    name = model.own(name)
    entry = EFFECTS[name]
    if entry.profile:
        return [Release((), own_of_each([name], records))]
    return released(name, model, records, entry.starts(model, records))


def released(
    name: str, model: DrivelineModel, records: Sequence[Record], starts: Sequence[effect.FitStart]
) -> list[Release]:
    """Return an effect's parameters as unknowns from start points in units of its scales."""
    entry = EFFECTS[name]
    own = own_of_each([name], records)
    scales = entry.scales(model, records)
    return [
        Release(
            tuple(
                _unknown(name, parameter, scale, x)
                for parameter, scale, x in zip(entry.shared_parameters, scales, start, strict=True)
            ),
            own,
        )
        for start in starts
    ]


def own_of_each(names: Iterable[str], records: Sequence[Record]) -> tuple[tuple[Shared, ...], ...]:
    """Return the unknowns that effects have in each of some recordings, the first of them the earliest.

    What continues from one recording to the next is counted from the first one: what that began with is part of the
    line's own values. So is it in later pieces of the first recording, whose time continues.
    """
    names, found = list(names), []
    of_first = records[0].name.partition("#")[0]
    for record in records:
        continues = record.since_start_s[0] > 0.0 and record.name.partition("#")[0] == of_first
        is_first = record is records[0] or record.lead is records[0] or continues
        lasting = {(name, p.name) for name in names for p in EFFECTS[name].own_parameters if p.outlasts and is_first}
        own = own_unknowns(names, record)
        found.append(tuple(replace(u, low=u.start, high=u.start) if (u.effect, u.name) in lasting else u for u in own))
    return tuple(found)


def own_unknowns(names: Iterable[str], record: Record) -> tuple[Shared, ...]:
    """Return the unknowns that effects have in each recording, at their starts in this one."""
    return tuple(unknown for name in sorted(names) for unknown in _own_unknowns(EFFECTS[name], record))


def _unknown(effect: str, parameter: EffectParameter, scale: float, x: float | Held | Within) -> Shared:
    if isinstance(x, Held):
        return Shared(effect, parameter.name, scale, x.value, x.value, x.value)
    if isinstance(x, Within):
        return Shared(effect, parameter.name, scale, x.low, x.high, x.value)
    low, high = max(parameter.low, parameter.least / scale), min(parameter.high, parameter.most / scale)
    return Shared(effect, parameter.name, scale, low, high, x)  # what a model may hold, and no more


def _own_unknowns(entry: Effect, record: Record) -> tuple[Shared, ...]:
    since = record.since_start_s
    first, last = float(since[0]), float(since[-1]) + record.sample_time_s
    return tuple(
        Shared(entry.name, parameter.name, 1.0, first, last, first)
        if entry.event
        else Shared(entry.name, parameter.name, 1.0, parameter.low, parameter.high, parameter.null)
        for parameter in entry.own_parameters
    )


@dataclass(frozen=True, slots=True)
class LocalBasis:
    """The unknowns of one recording: load torque, initial state, own parameters of effects, a load profile."""

    structure: Structure  # how many masses, or a joint
    has_angle: bool  # whether the motor's angle at the start is unknown, too
    scale: FloatArray  # (L,): size of each unknown, in its unit
    guess: FloatArray  # (L,): where a fit starts, in units of ``scale``
    own: tuple[Shared, ...]  # own parameters of effects, O of them
    profile: FloatArray  # (K, N): basis of the load profile, whose K unknowns stand last
    held: tuple[int, ...] = ()  # unknowns that stay where a fit starts

    @property
    def low(self) -> FloatArray:
        """Lower bounds of the scaled unknowns, shape (L,)."""
        return self._bounds([s.low for s in self.own], -np.inf)

    @property
    def high(self) -> FloatArray:
        """Upper bounds of the scaled unknowns, shape (L,)."""
        return self._bounds([s.high for s in self.own], np.inf)

    def _bounds(self, of_own: Sequence[float], free: float) -> FloatArray:
        bounds = np.full(self.guess.size, free)
        if self.held:
            bounds[list(self.held)] = self.guess[list(self.held)]
        bounds[self.own_rows] = of_own
        return bounds

    @property
    def own_rows(self) -> slice:
        """Where the own parameters stand."""
        last = self.guess.size - self.profile.shape[0]
        return slice(last - len(self.own), last)

    @property
    def profile_rows(self) -> slice:
        """Where the unknowns of the load profile stand."""
        return slice(self.guess.size - self.profile.shape[0], self.guess.size)

    def start(self, x: FloatArray) -> InitialCondition:
        """Return the start state of scaled unknowns ``x``, shape (L,)."""
        values = x * self.scale
        if self.structure is Structure.JOINT:
            return InitialCondition(float(values[0]), 0.0, 0.0, float(values[1]), preload_nm=float(values[PRELOAD]))
        angle = float(values[2]) if self.has_angle else 0.0
        i = self.twist_index
        state = () if i is None else (float(value) for value in values[i : self.own_rows.start])
        return InitialCondition(float(values[0]), angle, float(values[1]), *state)

    def entered(self, x: FloatArray, start: InitialCondition) -> FloatArray:
        """Return scaled unknowns ``x`` of a line in motion with another start state, shape (L,)."""
        angle = (start.angle_rad,) if self.has_angle else ()
        shafts = (start.twist_rad, start.load_speed_rad_s, start.middle_twist_rad, start.middle_speed_rad_s)
        first = self.own_rows.start
        entered = x.copy()
        entered[:first] = (start.load_torque_nm, start.speed_rad_s, *angle, *shafts)[:first] / self.scale[:first]
        return entered

    @property
    def twist_index(self) -> int | None:
        """Where the initial twist stands among the unknowns; None for one mass."""
        if self.structure is Structure.ONE_MASS:
            return None
        if self.structure is Structure.JOINT:
            return TWIST
        return 3 if self.has_angle else 2

    def parameters(self, p: FloatArray, x: FloatArray) -> FloatArray:
        """Return the kernel's parameter vector with the recording's own parameters in it; ``p`` where it has none."""
        if not self.own:
            return p
        filled = p.copy()
        for unknown, value in zip(self.own, x[self.own_rows], strict=True):
            filled[unknown.slot] = unknown.scale * value
        return filled

    def extra_load(self, x: FloatArray) -> FloatArray | None:
        """Return the load profile of scaled unknowns, shape (N,) [Nm]; None without one."""
        if self.profile.shape[0] == 0:
            return None
        return (x[self.profile_rows] * self.scale[self.profile_rows]) @ self.profile


def local_basis(
    model: DrivelineModel,
    record: Record,
    profile: bool,
    own: tuple[Shared, ...] = (),
    effects: frozenset[str] = frozenset(),
    has_own_load: bool = True,
) -> LocalBasis:
    """Set up the unknowns of one recording under some effects, with a start read off its first samples.

    Without a load torque of its own that is held at 0: what the model or all recordings have comes on top.
    """
    if model.structure is Structure.JOINT:
        return _joint_basis(record, own, effects, has_own_load)
    speed = measured_speed(record)
    v_scale, t_scale = speed_scale([record]), torque_scale([record])
    first = speed[np.flatnonzero(np.isfinite(speed))[:3]].mean()
    load = _mean_load(model, record, speed)
    has_angle = record.kind is OutputKind.POSITION
    scale, guess = [0.1 * t_scale, 0.1 * v_scale], [load if has_own_load else 0.0, first]
    if has_angle:
        y = record.output[record.okay]
        scale.append(max(0.01 * float(np.ptp(y)), np.finfo(float).tiny))
        guess.append(float(y[0]))
    values = model.values()
    for spring in ("k", "k_2"):
        if spring in values:
            swing = t_scale / (values["J_M"] * float(natural_frequencies_rad_s(values)[0]))
            scale += [0.1 * t_scale / values[spring], 0.1 * swing]
            guess += [load / values[spring], first]
    shape = grade_basis(record.time_s) if profile else np.empty((0, record.time_s.size))
    count = shape.shape[0]
    all_scales = np.array(scale + [1.0] * len(own) + [0.05 * t_scale] * count)
    all_guesses = np.array(guess + [unknown.start for unknown in own] + [0.0] * count)
    held = (*(() if has_own_load else (LOAD_TORQUE,)), *_not_settable(model, has_angle, len(scale)))
    return LocalBasis(model.structure, has_angle, all_scales, all_guesses / all_scales, own, shape, held)


def _not_settable(model: DrivelineModel, has_angle: bool, count: int) -> tuple[int, ...]:
    """Return which of the first ``count`` unknowns are states that a plant simulated elsewhere can't start from."""
    if model.plant is None:
        return ()
    angle = ("angle_rad",) if has_angle else ()
    states = ("speed_rad_s", *angle, "twist_rad", "load_speed_rad_s", "middle_twist_rad", "middle_speed_rad_s")
    return tuple(i for i, name in enumerate(states, start=1) if i < count and name not in model.plant.starts)


def shared_load(model: DrivelineModel, records: Sequence[Record]) -> Shared:
    """Return the load torque that is one for all recordings as an unknown."""
    scale = 0.1 * torque_scale(records)
    guesses = (
        0.0 if record.imposed is not None else _mean_load(model, record, measured_speed(record)) for record in records
    )
    return Shared("", LOAD, scale, -np.inf, np.inf, sum(guesses) / len(records) / scale)


def _joint_basis(record: Record, own: tuple[Shared, ...], effects: frozenset[str], has_own_load: bool) -> LocalBasis:
    """Set up the constant torque of a joint, its twist at the start and its preload, none until a fit knows better."""
    shown = frozenset[str]().union(*(EFFECTS[name].shows_start for name in effects if name))
    held = (*(() if "twist" in shown else (TWIST,)), *(() if "preload" in shown else (PRELOAD,)))
    twist = max(0.1 * float(np.ptp(motor_angle(record))), np.finfo(float).tiny)
    torque = 0.1 * torque_scale([record])
    scale = np.array([torque, twist, torque, *[1.0] * len(own)])
    held = held if has_own_load else (LOAD_TORQUE, *held)
    load = -float(record.output[record.okay].mean()) if has_own_load else 0.0
    guess = np.array([load, 0.0, 0.0, *(unknown.start for unknown in own)])
    nothing = np.empty((0, record.time_s.size))
    return LocalBasis(Structure.JOINT, False, scale, guess / scale, own, nothing, held)


def _mean_load(model: DrivelineModel, record: Record, speed: FloatArray) -> float:
    """Return the mean torque left after viscous friction and acceleration of the whole line [Nm]."""
    values = model.values()
    inertia = values["J_M"] + values.get("J_2", 0.0) + values.get("J_L", 0.0)
    viscous = values["b_M"] + values.get("b_L", 0.0)
    good = np.flatnonzero(np.isfinite(speed))
    duration = record.time_s[good[-1]] - record.time_s[good[0]]
    n = max(1, good.size // 50)
    acceleration = (speed[good[-n:]].mean() - speed[good[:n]].mean()) / duration
    return float(record.total_torque_nm.mean() - viscous * np.nanmean(speed) - inertia * acceleration)
