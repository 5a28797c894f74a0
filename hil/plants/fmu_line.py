"""The model in an FMU as ``hil diagnose`` takes it: a line that answers as it does, or a plant taken as it is.

Where a line of one or two inertias answers as the FMU to within what is recorded, that line is diagnosed, with the
whole catalogue. Elsewhere every output that is compared is the FMU's, and only what acts around it is tried.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from estimator.diagnosis.acquisition.chain import replay
from estimator.diagnosis.black_box import BlackBox, PlantSetting, equivalent_line
from estimator.diagnosis.flange import AT_LOAD, AT_MOTOR, FREE, slots_of, with_only
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.segments import thin
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.layout import flat, slot
from estimator.physics.model import DrivelineModel, Load, Structure
from estimator.physics.motion import motor_angle
from estimator.physics.parallel import concurrently
from estimator.signals.record import FloatArray, Location, OutputKind, Record
from hil.errors import UsageError
from hil.plants.fmu_plant import FmuPlant
from hil.plants.fmu_tune import Tuned, acting_as
from hil.plants.names import OF_A_POSITION, Names
from hil.recording.sandbox import Document

STARTS = ("speed_rad_s", "twist_rad", "load_speed_rad_s")
"""What of an initial state the names of ``--map start=`` stand for, in this order; of a position the angle first."""

FAST_ENOUGH_S = 1.0 / 240.0
"""Sampling period at which the line that answers as the plant does is fitted, at least."""

EQUIVALENT_SHARE = 0.1
"""Share of the noise of the readings within which a line answers as the FMU: a hundredth of its square."""

NOTHING = 1e-3
"""Share of the output's range that half a step may change where a law is put at a shaft; half as much is allowed where
that is tried, with the law rounded down to powers of two."""

MOST_PARTS = 16


@dataclass(frozen=True, slots=True)
class FmuLine:
    """What is diagnosed in the place of an FMU."""

    fmu: FmuPlant  # that the user gave
    model: DrivelineModel  # the line, or the plant with the line that is nearest
    named: Names  # which variables of the FMU are what
    error: float  # RMS by which the line is off from the FMU, in the unit of the output
    noise: float  # of the readings, in the unit of the output
    tuned: Mapping[str, Tuned]  # by the parameter of the line, the one of the FMU that acts as it

    @property
    def is_alike(self) -> bool:
        """Tell whether the line answers as the FMU to within what is recorded."""
        return self.error <= EQUIVALENT_SHARE * self.noise


def fmu_line(fmu: FmuPlant, records: Sequence[Record], tolerances: Mapping[str, float]) -> FmuLine:
    """Return what is diagnosed of an FMU, of recordings of one kind of output."""
    named = fmu.named(records[0].kind)
    known = {name: fmu.parameter(name) for name in tolerances}
    answered = concurrently(lambda record: _answered(record, fmu.run(record).output), records)
    line = equivalent_line([_thinned(record) for record in answered])
    errors = [replay(line, record).output - record.output for record in answered]
    error = float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
    tuned: dict[str, Tuned] = {}
    for name, tolerance in tolerances.items():
        value, unit = known[name]
        moved = {name: value * (1.0 + 0.5 * tolerance)}
        outputs = concurrently(partial(fmu.changed, values=moved), records)
        changed = [_thinned(_answered(record, output)) for record, output in zip(records, outputs, strict=True)]
        place, exponent = acting_as(name, line, changed, error, 1.0 + 0.5 * tolerance)
        if place in tuned:
            raise UsageError(f"--tune {name}: it acts as {tuned[place].name} does, {place} of a line. Take one of them")
        tuned[place] = Tuned(name, value, unit, exponent, tolerance)
    parameters = {
        name: replace(each, tolerance=tuned[name].of_line) if name in tuned else each
        for name, each in line.parameters.items()
    }
    found = FmuLine(fmu, replace(line, parameters=parameters), named, error, noise_floor(records), tuned)
    return found if found.is_alike else replace(found, model=_around(records[0], found))


def _flanges(fmu: FmuPlant, record: Record, named: Names, line: DrivelineModel) -> list[Document]:
    """Return the shafts at which laws can be put, each with the output that is its speed (``Flanges``)."""
    if not fmu.takes_laws(named) or record.kind is not OutputKind.SPEED:
        return []
    inertias, at_motor = line.values(), record.location is Location.MOTOR
    load_speed = named.load_speed or ("" if at_motor else named.output)
    has_load = line.structure is Structure.TWO_MASS and load_speed and fmu.is_input(named.load)
    laws = AT_MOTOR if line.structure is Structure.TWO_MASS else (*AT_MOTOR, *AT_LOAD)
    motor = {"speed": named.output, "input": named.torque, "sign": -1.0, "laws": laws, "inertia": inertias["J_M"]}
    load = {"speed": load_speed, "input": [named.load], "sign": 1.0, "laws": AT_LOAD, "inertia": inertias.get("J_L")}
    return [*([motor] if at_motor else []), *([load] if has_load else [])]


def _around(record: Record, found: FmuLine) -> DrivelineModel:
    """Return a model whose every simulation is the FMU's."""
    fmu, named, line, kind = found.fmu, found.named, found.model, record.kind
    flanges, parts, lock = _flanges(fmu, record, named, line), dict[tuple[str, float, bytes], int](), threading.Lock()
    states = ("angle_rad", *STARTS) if kind is OutputKind.POSITION else STARTS
    starts = dict(zip(named.start, states, strict=False))

    def run(record: Record, around: PlantSetting) -> FloatArray:
        values: dict[str, FloatArray | float] = {name: getattr(around.start, state) for name, state in starts.items()}
        values |= {each.name: each.value_of(around.tuned[name]) for name, each in found.tuned.items()}
        if named.load:
            values[named.load] = around.load_nm if fmu.is_input(named.load) else float(around.load_nm[0])
        if around.laws is None:
            return fmu.simulated(record, named, around.torque_nm, values)
        acting = [each for each in flanges if (with_only(around.laws, slots_of(each["laws"])) != flat(FREE)).any()]
        settings = {"flanges": acting, "sign_width": around.sign_width, "start_s": float(record.since_start_s[0])}
        given = (settings, {"p": around.laws, "angle": motor_angle(record)})

        usual = _rounded(around.laws, record)
        key = (record.name, record.sample_time_s, usual.tobytes())
        with lock:
            if key not in parts:  # the same, whichever of the cases that are rounded to it comes first
                start, at = fmu.settled(record, named), (settings, {**given[1], "p": usual})
                parts[key] = _fine_enough(lambda n: fmu.simulated(record, named, record.torque_nm, start, at, n))
        return fmu.simulated(record, named, around.torque_nm, values, given, parts[key])

    is_alike = {*named.start} <= {*Names().start, *OF_A_POSITION.start}
    plant = BlackBox(
        run, tuple(starts.values()), line, is_alike, tuple(found.tuned), [n for each in flanges for n in each["laws"]]
    )
    return replace(line, plant=plant, load=Load.OWN if named.load else 0.0)


def _rounded(laws: FloatArray, record: Record) -> FloatArray:
    """Return parameters of laws rounded to powers of two, towards 0; events last all the recording, phases are 0."""
    p = np.where(np.isfinite(laws), np.ldexp(np.sign(laws) * 0.5, np.frexp(laws)[1]), laws)
    for name, parameter in ((name, each.name) for name, entry in BUILT_IN.items() for each in entry.own_parameters):
        p[slot(name, parameter)] = record.since_start_s[-1] if parameter == "to_s" else 0.0
    return np.asarray(p, dtype=np.float64)


def _fine_enough(in_parts: Callable[[int], FloatArray]) -> int:
    """Return in how many parts a period is simulated so that twice as many change nothing."""
    parts, (output, finer) = 1, concurrently(in_parts, [1, 2])
    while parts < MOST_PARTS and float(np.abs(finer - output).max()) > 0.5 * NOTHING * float(np.ptp(finer)):
        parts *= 2
        if parts < MOST_PARTS:
            output, finer = finer, in_parts(2 * parts)
    return parts


def _answered(record: Record, output: FloatArray) -> Record:
    """Return a recording with the FMU's output in the place of the measured one."""
    return replace(record, channels=(), okay=np.ones_like(record.okay), output=output)


def _thinned(record: Record) -> Record:
    return thin(record, max(1, int(FAST_ENOUGH_S / record.sample_time_s)))
