"""The model in an FMU as ``hil diagnose`` takes it: a plant of which nothing is known but what it answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.black_box import BlackBox, equivalent_line
from estimator.diagnosis.preconditions.prepare import thin
from estimator.physics.driveline import Start
from estimator.physics.model import DrivelineModel, Load
from estimator.signals.record import FloatArray, OutputKind, Record
from hil.plants.fmu_plant import FmuPlant
from hil.plants.names import OF_A_POSITION, Names

STARTS = ("speed_rad_s", "twist_rad", "load_speed_rad_s")
"""What of an initial state the names of ``--map start=`` stand for, in this order; of a position the angle first."""

FAST_ENOUGH_S = 1.0 / 240.0
"""Sampling period at which the line that answers as the plant does is fitted, at least."""


def fmu_line(fmu: FmuPlant, records: Sequence[Record]) -> DrivelineModel:
    """Return the model that is questioned, of recordings of one kind of output."""
    kind = records[0].kind
    named = fmu.named(kind)
    states = ("angle_rad", *STARTS) if kind is OutputKind.POSITION else STARTS
    starts = dict(zip(named.start, states, strict=False))

    def run(record: Record, torque_nm: FloatArray, load_nm: FloatArray, start: Start) -> FloatArray:
        values: dict[str, FloatArray | float] = {name: getattr(start, state) for name, state in starts.items()}
        if named.load:
            values[named.load] = load_nm if fmu.is_input(named.load) else float(load_nm[0])
        return fmu.simulated(record, named, torque_nm, values)

    line = equivalent_line([_answered(fmu, record) for record in records])
    is_alike = {*named.start} <= {*Names().start, *OF_A_POSITION.start}
    plant = BlackBox(run, tuple(starts.values()), line, is_alike)
    return replace(line, plant=plant, load=Load.OWN if named.load else 0.0)


def _answered(fmu: FmuPlant, record: Record) -> Record:
    """Return a recording with the FMU's output in the place of the measured one."""
    alone = replace(record, channels=(), okay=np.ones_like(record.okay))
    answered = replace(alone, output=fmu.run(record).output)
    return thin(answered, max(1, int(FAST_ENOUGH_S / record.sample_time_s)))
