"""The design: every experiment that a rig may drive is driven on paper, and the one that tells most is chosen."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType

import numpy as np
from threadpoolctl import threadpool_limits

from drivers.errors import CommandRefused
from estimator.design.open import Open
from estimator.design.paper import Expected, Width, as_model, expected, shown, widths
from estimator.physics.model import DrivelineModel
from estimator.physics.tables import PREFIX
from estimator.signals.record import Record
from hil.design.candidates import ExperimentDict, Limits, candidates
from hil.errors import InputError, RunAborted, UsageError
from hil.orders.order import Order, RigSource
from hil.orders.runner import Prediction, predict

Progress = Callable[[str, float], None]

WORTH = 3.0
"""Factor by which an experiment has to change the odds to be worth driving (CONTRACT: design)."""

NEARLY = 0.02
"""Probability by which an experiment may tell less than another and be preferred for what it shows, how clearly."""

WIDE_INTERVAL = 0.1
"""Half of a 95 % interval over its value from which a parameter is not well known."""

SPEED_ROOM = 1.2
"""Part of the fastest speed that may be reached: a hold of it swings by some per cent."""


class NothingAllowed(UsageError):
    """No experiment passes the rig's limits."""


class Aim(Enum):
    """What the next experiment is for."""

    DECIDE = "decide"
    PARAMETERS = "parameters"
    LAW = "law"  # what it is where nothing is to be decided and a law without a name is left: not asked for by itself


@dataclass(frozen=True, slots=True)
class Planned:
    """An experiment as the most probable hypothesis drives it on paper."""

    name: str  # in words, for the operator
    table: ExperimentDict  # as it stands in a rig file
    record: Record  # its recorded part, simulated
    prediction: Prediction  # of the whole run

    @property
    def seconds(self) -> float:
        """Length of the whole run [s]."""
        return self.prediction.seconds

    @property
    def largest_nm(self) -> float:
        """Largest torque of both inverters together in the recorded part [Nm]."""
        return float(np.abs(self.prediction.torque_nm).max())

    @property
    def speed_rad_s(self) -> tuple[float, float]:
        """Slowest and fastest speed over the whole run [rad/s]."""
        return self.prediction.speed_rad_s.low, self.prediction.speed_rad_s.high

    @property
    def angle_rad(self) -> float:
        """How far the shaft turns from where the recorded part begins, at most [rad]."""
        return float(np.abs(np.cumsum(self.prediction.course_rad_s)).max()) * self.record.sample_time_s


@dataclass(frozen=True, slots=True)
class Design:
    """The experiment that was chosen, and what it is expected to bring."""

    aim: Aim  # what it is to bring
    key: str  # name of its table in a rig file
    planned: Planned  # the experiment itself
    decides: Expected | None  # where it is to decide between hypotheses
    widths: tuple[Width, ...]  # of the most probable hypothesis' values, now and after it
    shows: tuple[str, ...]  # effects that no recording so far shows or excludes, and this experiment does
    others: tuple[tuple[str, float], ...]  # what else was driven on paper, and what it was judged by
    refused: dict[str, str]  # what may not be driven, and why

    @property
    def factor(self) -> float:
        """By what factor it changes the odds, or shortens the intervals that are wide."""
        return _shortened(self.widths) if self.decides is None else self.decides.factor

    @property
    def is_worth_driving(self) -> bool:
        """Whether it tells enough to take the vehicle out."""
        if self.aim is Aim.DECIDE and self.shows:
            return True
        if (self.aim is Aim.DECIDE and self.decides is None) or (self.aim is Aim.LAW and not wide(self.widths)):
            return False
        return self.factor >= (WORTH if self.decides is not None else 1.0 + WIDE_INTERVAL)


def designed(
    source: RigSource, known: Open, aim: Aim, progress: Progress, left_out: Mapping[str, str] = MappingProxyType({})
) -> Design:
    """Choose the next experiment for a rig; none of those left out, by name and why.

    To decide, it is one that decides between explanations, where any does; of these the one that shows most of what no
    recording so far could. Where none decides, or nothing is to be decided between, it is the one that shows most;
    where nothing shows either and a law without a name is left, the one that makes its curve known best.
    """
    rig = source.rig()
    limits = Limits.of(rig)
    model = as_model(*known.foremost)
    found: list[_Judged] = []
    every = list(candidates(rig, limits))
    refused = {name: left_out[name] for name, _ in every if name in left_out}
    wanted = [each for each in every if each[0] not in refused]
    with threadpool_limits(1, user_api="blas"):
        for i, (name, table) in enumerate(wanted):
            progress(f"on paper: {name}", i / len(wanted))
            try:
                planned = on_paper(source, name, table, model, limits)
            except (InputError, CommandRefused, RunAborted) as error:
                refused[name] = str(error)
                continue
            found.append(_judged(known, planned, aim))
    progress("designed", 1.0)
    if not found:
        why = next(iter(refused.values()))
        raise NothingAllowed(
            f"rig {rig.name!r}: expected an experiment that it may drive, got none: of {len(every)} none passes its "
            f"limits, the first because: {why}"
        )
    decide = [each for each in found if each.decides is not None and each.decides.factor >= WORTH]
    shows = [each for each in found if each.shows]
    if aim is Aim.DECIDE and not decide and not shows and known.unnamed is not None:
        aim, found = Aim.LAW, [_judged(known, each.planned, Aim.LAW) for each in found]
    chosen = _best(decide) if decide else max(shows, key=_most_shown) if shows else _best(found)
    decides = chosen.decides if decide or not shows else None
    others = tuple((each.planned.name, each.value(decides)) for each in found if each is not chosen)
    return Design(
        aim,
        free_key(list(rig.experiments)),
        chosen.planned,
        decides,
        _widths(known, chosen.planned, aim),
        tuple(chosen.shows),
        tuple(sorted(others, key=lambda each: -each[1])),
        refused,
    )


@dataclass(frozen=True, slots=True)
class _Judged:
    """An experiment on paper, and what it tells."""

    planned: Planned
    decides: Expected | None
    shows: Mapping[str, float]  # effects that are untested so far, with the expected difference of scores
    shortened: float  # factor by which wide intervals shorten; NaN where that is not asked

    def value(self, decides: Expected | None) -> float:
        """Return what it is compared by: probability of the true explanation, effects shown, or shorter intervals."""
        if decides is not None and self.decides is not None:
            return self.decides.right
        return float(len(self.shows)) if math.isnan(self.shortened) else self.shortened


def _judged(known: Open, planned: Planned, aim: Aim) -> _Judged:
    if aim is not Aim.DECIDE:
        return _Judged(planned, None, {}, _shortened(_widths(known, planned, aim)))
    is_single = len(known.candidates) == 1 or known.is_decided
    decides = None if is_single else expected(known, planned.record)
    return _Judged(planned, decides, shown(known, planned.record), math.nan)


def _best(judged: Sequence[_Judged]) -> _Judged:
    """Return the one that tells most; of those that tell nearly as much, what shows most, most clearly."""
    values = [each.value(each.decides) for each in judged]
    enough = max(values) - NEARLY * (1.0 if judged[0].decides is not None else max(values))
    return max((each for each, value in zip(judged, values, strict=True) if value >= enough), key=_most_shown)


def _most_shown(judged: _Judged) -> tuple[int, float, float]:
    """Return how much an experiment shows, then how clearly in each second of its drive, then its shortness.

    What is decided by likelihood has to be seen in a free run, too: of drives that decide alike the clearest is taken.
    """
    clear = min(judged.shows.values(), default=0.0) if judged.decides is None else math.log(judged.decides.factor)
    return len(judged.shows), clear / judged.planned.seconds, -judged.planned.seconds


def is_needed(known: Open, aim: Aim) -> bool:
    """Tell whether there is anything that an experiment could tell."""
    if aim is Aim.PARAMETERS or known.untested or known.unnamed is not None:
        return True
    return len(known.candidates) > 1 and not known.is_decided


def _widths(known: Open, planned: Planned, aim: Aim) -> tuple[Width, ...]:
    """Return how well values are known now, and then; those of the curve alone where a law is what it is for."""
    found = tuple(widths(*known.foremost, planned.record))
    return tuple(each for each in found if aim is not Aim.LAW or each.name.startswith(PREFIX))


def on_paper(source: RigSource, name: str, table: ExperimentDict, model: DrivelineModel, limits: Limits) -> Planned:
    """Drive an experiment on paper, through the torque guard and within the limits."""
    rig, _ = source.ordered(Order("next", table))
    prediction = predict(rig, "next", model)
    planned = Planned(name, table, _record(name, rig.period_s, prediction), prediction)
    fastest = max(map(abs, planned.speed_rad_s))
    if fastest > SPEED_ROOM * limits.speed_rad_s:
        raise UsageError(f"it reaches {fastest:.3g} rad/s, allowed are {limits.speed_rad_s:.3g}")
    if planned.angle_rad > limits.angle_rad:
        raise UsageError(f"it turns the shaft by {planned.angle_rad:.3g} rad, allowed are {limits.angle_rad:.3g}")
    return planned


def _record(name: str, period_s: float, prediction: Prediction) -> Record:
    speed = prediction.course_rad_s
    okay = np.ones(speed.size, dtype=np.bool_)
    return Record(name, period_s, period_s * np.arange(speed.size, dtype=np.float64), prediction.each_nm, speed, okay)


def _shortened(values: Sequence[Width]) -> float:
    """Return the mean factor by which the intervals that are wide become shorter; all, where none is."""
    found = wide(values) or list(values)
    return math.exp(float(np.mean([math.log(max(each.now, 1e-300) / max(each.after, 1e-300)) for each in found])))


def wide(values: Sequence[Width]) -> list[Width]:
    """Return the intervals that are wide; those of a curve against its largest value: one of its values may be 0."""
    of_curve = max((abs(each.value) for each in values if each.name.startswith(PREFIX)), default=0.0)
    sizes = (of_curve if each.name.startswith(PREFIX) else abs(each.value) for each in values)
    return [each for each, size in zip(values, sizes, strict=True) if each.now > WIDE_INTERVAL * size]


def free_key(taken: Sequence[str]) -> str:
    """Return the first of ``next_1``, ``next_2``, … that a rig file does not have."""
    number = 1
    while f"next_{number}" in taken:
        number += 1
    return f"next_{number}"
