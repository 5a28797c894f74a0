"""Physical parameters of one or two masses from runs, and the delay between torque and speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from estimator.identification.linear_model import Orders
from estimator.identification.modes.modes import Mode
from estimator.physics.driveline import UNKNOWN_WITHIN
from estimator.physics.effects.dry_friction import COULOMB_FRICTION_MOTOR
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.motion import torque_scale
from estimator.physics.unknowns import Shared
from estimator.signals.decimate import decimate
from estimator.signals.record import Record
from hil.commission.responses import HIGH_PASS_HZ, TRUSTED, Z95, Measured

if TYPE_CHECKING:
    from estimator.identification.offline.fits import LinearFit
    from estimator.physics.fit import FitResult


WIDEST = 100.0
"""A parameter may end so many times above or below where it starts."""

MOTOR_SHARES = (0.01, 0.03, 0.1, 0.3)
"""Parts of the total inertia that the motor may have: starts of the two-mass fit."""

FRICTION_RATE = 0.01
"""Start of a viscous friction, over the inertia it brakes [1/s]: a vehicle rolls on for minutes."""

NATURAL_DELAY = 1
"""Samples of delay that sampling alone makes."""

LONGEST = 5
"""Longest delay tried [samples]."""


@dataclass(frozen=True, slots=True)
class PhysicalFit:
    """A fitted model, its parameters with intervals, and what is left."""

    model: DrivelineModel  # Its parameters have their intervals, no shorter than `TRUSTED`
    parameters: Mapping[str, Measured]  # Every parameter by name
    load_nm: Mapping[str, Measured]  # Constant load torque of each recording
    rms: float  # RMS of the free-run error [rad/s]

    def undetermined(self) -> PhysicalFit:
        """Return it as one of another line: a wrong structure shifts the values, however short their intervals.

        A lag of 20 ms that nobody knew of had made 1.52 kg m² of a motor 3.07 ± 0.47.
        """
        unknown = {
            name: Parameter.measured(value, max(spread, UNKNOWN_WITHIN * value), TRUSTED)
            for name, (value, spread) in self.parameters.items()
            if name in self.model.parameters
        }
        parameters = {name: Measured(value, math.inf) for name, (value, _) in self.parameters.items()}
        return replace(self, model=replace(self.model, parameters=unknown), parameters=parameters)


def fit_rigid(records: Sequence[Record], inertia_kg_m2: float) -> PhysicalFit:
    """Fit one inertia with viscous and dry friction; the dry friction is parameter ``friction_nm``."""
    model = DrivelineModel(
        Structure.ONE_MASS,
        {"J_M": Parameter(inertia_kg_m2, TRUSTED), "b_M": Parameter(FRICTION_RATE * inertia_kg_m2, TRUSTED)},
    )
    scale = 0.05 * torque_scale(records)
    dry = Shared(COULOMB_FRICTION_MOTOR.name, "friction_nm", scale, 0.0, WIDEST, 0.1)
    return _fitted([model], records, (dry,))


def fit_two_mass(records: Sequence[Record], inertia_kg_m2: float, mode: Mode) -> PhysicalFit:
    """Fit motor, shaft and load, from the total inertia and the resonance as they are roughly known."""
    return _fitted([_two_mass(inertia_kg_m2, mode, share) for share in MOTOR_SHARES], records, ())


def _two_mass(inertia_kg_m2: float, mode: Mode, motor_share: float) -> DrivelineModel:
    """Return a two-mass model of a total inertia and a resonance.

    ``w^2 = k (1/J_M + 1/J_L)`` and ``2 z w = c (1/J_M + 1/J_L)`` for little friction.
    """
    motor, load = motor_share * inertia_kg_m2, (1.0 - motor_share) * inertia_kg_m2
    flexibility = 1.0 / motor + 1.0 / load
    omega = 2.0 * math.pi * mode.frequency_hz
    values = {
        "J_M": motor,
        "J_L": load,
        "k": omega**2 / flexibility,
        "c": 2.0 * max(mode.damping, 0.01) * omega / flexibility,
        "b_M": FRICTION_RATE * motor,
        "b_L": FRICTION_RATE * load,
    }
    return DrivelineModel(Structure.TWO_MASS, {name: Parameter(value, TRUSTED) for name, value in values.items()})


def _fitted(starts: Sequence[DrivelineModel], records: Sequence[Record], more: tuple[Shared, ...]) -> PhysicalFit:
    from estimator.physics.fit import best_fit
    from estimator.physics.problem import make_problem

    problems = [make_problem(model, records, (*_unknowns(model), *more)) for model in starts]
    results = [best_fit([problem]) for problem in problems]
    best = min(range(len(results)), key=lambda i: results[i].squares)
    return _summary(starts[best], results[best])


def _unknowns(model: DrivelineModel) -> tuple[Shared, ...]:
    return tuple(
        Shared("", name, parameter.value, 1.0 / WIDEST if name[0] in "Jk" else 0.0, WIDEST, 1.0)
        for name, parameter in model.parameters.items()
    )


def _summary(model: DrivelineModel, result: FitResult) -> PhysicalFit:
    from estimator.diagnosis.assemble import load_torques
    from estimator.diagnosis.covariance import reported_covariance

    covariance = reported_covariance(result)
    values = {
        shared.name: Measured(
            shared.scale * float(result.x[i]), Z95 * shared.scale * float(np.sqrt(max(covariance[i, i], 0.0)))
        )
        for i, shared in enumerate(result.problem.shared)
    }
    parameters = {name: Parameter.measured(*values[name], TRUSTED) for name in model.parameters}
    loads = {
        name: Measured(load.value, 0.5 * (load.ci95[1] - load.ci95[0]))
        for name, load in load_torques(result, covariance, model).items()
    }
    return PhysicalFit(DrivelineModel(model.structure, parameters), values, loads, result.rms)


@dataclass(frozen=True, slots=True)
class DelaySelection:
    """The delay that suits best, beyond the sample that is natural, and the model with it."""

    extra_samples: int  # beyond `NATURAL_DELAY`, 0 to 4
    fit: LinearFit  # of the output-error method, with that delay


def select_delay(record: Record) -> DelaySelection:
    """Choose the delay from torque to speed."""
    data = decimate(record, 1, HIGH_PASS_HZ)
    from estimator.identification.offline.fits import fit_output_error  # a second, and the bus comes first

    fits = [fit_output_error(data, Orders(nk=nk)) for nk in range(NATURAL_DELAY, LONGEST + 1)]
    best = min(range(len(fits)), key=lambda i: fits[i].rms)
    return DelaySelection(best, fits[best])
