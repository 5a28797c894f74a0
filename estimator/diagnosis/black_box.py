"""A plant that another program simulates: its torques pass through a torque path, its speed through a sensor.

Both are those of the compiled simulation, without a line of their own. On a free inertia of 1 kg m^2 the change of
speed over a period is the mean torque that reached the shaft in it. Turned round, an inertia that is driven by the
change of a speed moves at that speed, and the sensor shows of it what it would of the plant's.

The plant's own simulation takes long. What a changed parameter changes is simulated on a line that answers much as the
plant does, and added to the plant's output without the change (space mapping: Bandler and others, IEEE Trans. MTT
42(12), 1994). So derivatives and first looks are those of that line; every output that is compared with a recording is
the plant's. By that line are also judged how a disturbance of the torque shows in the output, the time scale on which
that moves, and in which unit the torque is; it takes no part in what is simulated.
"""

from __future__ import annotations

import hashlib
import math
import threading
from collections import deque
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import astuple, dataclass, field, fields, replace
from weakref import WeakKeyDictionary

import numpy as np

from estimator.diagnosis.flange import FREE, slots_of, with_only
from estimator.diagnosis.thresholds import StandIns
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, fit, make_problem
from estimator.physics.inputs import load_of
from estimator.physics.kernel import state_vector
from estimator.physics.layout import LOAD, NOMINAL, Grid, flat, grid_for, slot
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.motion import measured_speed, motor_angle
from estimator.physics.simulate import simulate, simulate_each
from estimator.physics.unknowns import Shared
from estimator.signals.record import FloatArray, OutputKind, Record, once

FINER = 4  # steps to a sample where a torque is late by parts of one, or the output filtered within one
FEWEST_KEPT, MOST_KEPT = 4, 512  # outputs that are kept, and of each recording that changes are added to
KEPT_BYTES = 64 << 20  # memory that those of long recordings may take

_GRID = Grid(Structure.ONE_MASS, 1, 0.0)

_EFFECT_AT = {
    slot(name, parameter.name): name for name, entry in BUILT_IN.items() for parameter in entry.parameters
} | {slot("", name): "" for name in (*NOMINAL, LOAD)}
_STATE = tuple(each.name for each in fields(InitialCondition))
_WITHIN = [
    slot(name, key)
    for name, key in (
        ("transport_delay", "delay_s"),
        ("actuator_lag", "time_constant_s"),
        ("clock_drift", "rate"),
        ("speed_filter", "time_constant_s"),
    )
]
"""What acts within a sample."""

ITERATIONS = 12  # of the fit from each start; the best goes to its end


@dataclass(frozen=True, slots=True)
class PlantSetting:
    """What a plant is simulated with."""

    torque_nm: FloatArray  # (N, M): of its inputs
    load_nm: FloatArray  # (N,)
    start: InitialCondition  # of the line that stands for the plant
    tuned: Mapping[str, float]  # factor on those of its parameters that act as the line's of these names
    laws: FloatArray | None  # (layout.SIZE,): parameters of laws at its shafts (``flange``), where there are any
    sign_width: float  # speed within which their dry friction changes sign [rad/s]


Simulated = Callable[[Record, PlantSetting], FloatArray]
"""Recording, and what it is simulated with, to the true output (N,)."""


def _slots(elements: Collection[Element]) -> list[int]:
    entries = (entry for entry in BUILT_IN.values() if entry.element in elements)
    return [slot(entry.name, parameter.name) for entry in entries for parameter in entry.parameters]


_INPUT, _SENSOR = _slots((Element.TORQUE_PATH, Element.ACQUISITION)), _slots((Element.SPEED_SENSOR,))


@dataclass(frozen=True, slots=True)
class _Known:
    """A case of which the output is known; shape (N,)."""

    case: Case
    output: FloatArray

    def distance(self, case: Case, has_start: bool) -> float:
        """Return how far a case is from this one, as the sum of relative changes; infinity where it is not near."""
        if self.case.extra_load_nm is not case.extra_load_nm:
            return math.inf
        places = np.flatnonzero(self.case.p != case.p).tolist()
        moved = [name for name in _STATE if getattr(self.case.start, name) != getattr(case.start, name)]
        if len({_EFFECT_AT[i] for i in places}) + len(moved) > 1 or not (has_start or {*moved} <= {"load_torque_nm"}):
            return math.inf
        pairs = [(float(self.case.p[i]), float(case.p[i])) for i in places]
        pairs += [(getattr(self.case.start, name), getattr(case.start, name)) for name in moved]
        return sum(abs(a - b) / (abs(a) + abs(b)) if math.isfinite(a + b) else 1.0 for a, b in pairs)


@dataclass
class BlackBox:
    """A plant simulated by another program, with the catalogue's effects at its inputs and its output."""

    run: Simulated  # the plant alone
    starts: Collection[str]  # what of the initial state it can be given
    line: DrivelineModel  # a line that answers much as it does
    has_start: bool  # whether the initial state of that line means the same
    tuned: Collection[str] = ()  # parameters of that line that parameters of the plant act as
    laws: Collection[str] = ()  # effects whose torque can be put at its shafts
    _known: dict[bytes, Future[FloatArray]] = field(default_factory=dict)  # outputs by digest of recording and case
    # Latest cases of each recording.
    _around: WeakKeyDictionary[Record, deque[_Known]] = field(default_factory=WeakKeyDictionary)
    _lock: threading.Lock = field(default_factory=threading.Lock)  # of both: cases are simulated in threads

    def simulated(self, record: Record, cases: Sequence[Case]) -> FloatArray:
        """Simulate the recorded output of a recording, as its sensor shows it, under each case; shape (K, N)."""
        with self._lock:
            around = self._around.setdefault(record, deque(maxlen=_most_kept(record)))
        if len(cases) == 1:
            output = self._read(record, cases[0])
            around.append(_Known(cases[0], output))
            return output[np.newaxis]
        return np.array([self._near(record, tuple(around), case) for case in cases])

    def _near(self, record: Record, around: Sequence[_Known], case: Case) -> FloatArray:
        """Add what the line's output changes to that of the nearest case, in whatever order they came to be known."""
        distances = [each.distance(case, self.has_start) for each in around]
        if (least := min(distances, default=math.inf)) == math.inf:
            return self._read(record, case)
        equals = [each for each, distance in zip(around, distances, strict=True) if distance == least]
        known = min(equals, key=lambda each: (each.case.p.tobytes(), astuple(each.case.start)))
        before, after = simulate_each(grid_for(self.line, [record]), record, [known.case, case])
        return known.output + (after - before)

    def _read(self, record: Record, case: Case) -> FloatArray:
        steps = FINER if (case.p[_WITHIN] != 0.0).any() else 1
        fine = _finer(record) if steps > 1 else record
        output = self._output(fine, case, np.repeat(load_of(case, record), steps))
        if record.kind is not OutputKind.SPEED:
            return output[::steps]
        rising = np.append(np.diff(output), 0.0) / fine.sample_time_s
        moved = replace(fine, torque_nm=rising[:, np.newaxis], load_nm=None)
        initial = Case(with_only(case.p, _SENSOR), InitialCondition(0.0, 0.0, float(output[0])))
        found: FloatArray = simulate_each(_GRID, moved, [initial])[0]
        return found[::steps]

    def _output(self, record: Record, case: Case, load: FloatArray) -> FloatArray:
        """Return the plant's own output, shape (N,), of the case's torques and load, shape (N,) [Nm]."""
        torque = _applied(record, case.p)
        settable = [float(getattr(case.start, name)) for name in self.starts]
        nominal = self.line.values()
        tuned = {name: float(case.p[slot("", name)]) / nominal[name] for name in self.tuned}
        width = grid_for(self.line, [record]).sign_width
        laws = with_only(case.p, slots_of(self.laws))
        acting = laws if (laws != flat(FREE)).any() else None
        settings = [record.sample_time_s, record.since_start_s[0], *settable, *tuned.values()]
        at_shafts = [] if acting is None else [acting, motor_angle(record)]
        key = hashlib.sha256(np.concatenate([settings, torque.ravel(), load, *at_shafts]).tobytes()).digest()
        with self._lock:
            known = self._known.get(key)
            if known is None:
                while len(self._known) >= _most_kept(record):
                    self._known.pop(next(iter(self._known)))
                self._known[key] = mine = Future[FloatArray]()
        if known is not None:
            return known.result()
        try:
            mine.set_result(self.run(record, PlantSetting(torque, load, case.start, tuned, acting, width)))
        except BaseException as error:
            with self._lock:
                self._known.pop(key, None)
            mine.set_exception(error)
            raise
        return mine.result()


def _most_kept(record: Record) -> int:
    return min(MOST_KEPT, max(FEWEST_KEPT, KEPT_BYTES // record.output.nbytes))


def _applied(record: Record, p: FloatArray) -> FloatArray:
    """Return the torque of each input that reaches the shaft, in the mean of each period, shape (N, M) [Nm].

    The inputs act on one shaft: what becomes of their sum on its way is added to the first.
    """
    path = with_only(p, _INPUT)
    if (path == flat(FREE)).all():
        return record.torque_nm
    speed = simulate(
        _GRID, replace(record, load_nm=None), path, InitialCondition(0.0, 0.0, 0.0), output=state_vector.SPEED
    )
    mean = np.diff(speed) / record.sample_time_s
    applied = record.torque_nm.copy()
    applied[:-1, 0] += mean - record.total_torque_nm[:-1]
    return applied


@once
def _finer(record: Record) -> Record:
    """Return a recording at ``FINER`` steps to a sample, its torque held, its output on straight lines."""
    period_s = record.sample_time_s / FINER
    time_s = record.time_s[0] + period_s * np.arange(FINER * record.time_s.size)
    return replace(
        record,
        sample_time_s=period_s,
        time_s=time_s,
        torque_nm=np.repeat(record.torque_nm, FINER, axis=0),
        output=np.interp(time_s, record.time_s, record.output),
        okay=np.repeat(record.okay, FINER),
        torque_okay=None,
        offset_s=None if record.offset_s is None else np.repeat(record.offset_s, FINER),
        reference_nm=None,
        load_nm=None,
        channels=(),
    )


def equivalent_line(records: Sequence[Record]) -> DrivelineModel:
    """Return a line with one inertia or two, trusted exactly, that answers as the outputs of some recordings."""
    inertia, viscous = _rigid(records)
    one = _fitted(Structure.ONE_MASS, {"J_M": inertia, "b_M": viscous}, records)
    highest = min(StandIns.HIGHEST_HZ, StandIns.OF_RATE / records[0].sample_time_s)
    starts = [
        _two_masses(inertia, viscous, share, hz)
        for share in StandIns.SHARES
        for hz in np.geomspace(StandIns.LOWEST_HZ, highest, StandIns.FREQUENCIES).tolist()
    ]
    near = min((_fitted(Structure.TWO_MASS, start, records) for start in starts), key=lambda result: result.rms)
    two = fit(near.problem, near.x)
    structure, best = (Structure.TWO_MASS, two) if two.rms < StandIns.BETTER * one.rms else (Structure.ONE_MASS, one)
    values = best.values_of("")
    return DrivelineModel(structure, {name: Parameter(values[name], 0.0) for name in structure.parameter_names})


def _rigid(records: Sequence[Record]) -> tuple[float, float]:
    """Return inertia and viscous friction of a rigid line, by regression on ``J (w - w_0) = S T - b S w - T_0 t``."""
    columns, moved = [], []
    for record in records:
        whole, period_s = measured_speed(record), record.sample_time_s
        known = np.isfinite(whole)  # the slope of an angle is not, at its ends
        speed, time_s = whole[known], record.time_s[known]
        turned, driven = (np.cumsum(each) * period_s for each in (speed, record.total_torque_nm[known]))
        columns.append(np.column_stack([driven, -turned, time_s[0] - time_s])[:-1])
        moved.append(speed[1:] - speed[0])
    found = np.linalg.lstsq(np.concatenate(columns), np.concatenate(moved), rcond=None)[0]
    inertia = 1.0 / max(abs(float(found[0])), np.finfo(float).tiny)
    return inertia, max(float(found[1]) * inertia, StandIns.LEAST_VISCOUS * inertia)


def _two_masses(inertia: float, viscous: float, share: float, hz: float) -> dict[str, float]:
    motor, load = share * inertia, (1.0 - share) * inertia
    reduced, turn = motor * load / inertia, 2.0 * math.pi * hz
    half = 0.5 * viscous
    return {
        "J_M": motor,
        "J_L": load,
        "k": reduced * turn**2,
        "c": 2.0 * StandIns.DAMPING * reduced * turn,
        "b_M": half,
        "b_L": half,
    }


def _fitted(structure: Structure, start: Mapping[str, float], records: Sequence[Record]) -> FitResult:
    model = DrivelineModel(structure, {name: Parameter(start[name], 0.0) for name in structure.parameter_names})
    shared = [
        Shared("", name, start[name], 1.0 / StandIns.SEARCH_FACTOR, StandIns.SEARCH_FACTOR, 1.0)
        for name in structure.parameter_names
    ]
    return fit(make_problem(model, records, shared), iterations=ITERATIONS)
