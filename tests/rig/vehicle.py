"""A vehicle of one inertia, stepped by hand: enough to drive a plan without a rig."""

import math
from dataclasses import dataclass, field

from hil.rig.experiments.base import Experiment, Phase

PERIOD_S = 0.01
INERTIA_KG_M2 = 101.6


@dataclass
class RigidVehicle:
    """J w' = T - b w - load, one explicit Euler step per cycle; its time constant J/b is 8000 steps."""

    inertia_kg_m2: float = INERTIA_KG_M2
    friction_nm_s: float = 1.25
    load_nm: float = 0.0
    speed_rad_s: float = 0.0
    resolver_error_rad: float = 0.0
    angle_rad: float = 0.0

    @property
    def reading_rad_s(self) -> float:
        """What the resolver shows: its angle is off by so much, once a turn [rad/s]."""
        return self.speed_rad_s * (1.0 + self.resolver_error_rad * math.cos(self.angle_rad))

    def advance(self, torque_nm: float) -> None:
        net_nm = torque_nm - self.friction_nm_s * self.speed_rad_s - self.load_nm
        self.speed_rad_s += PERIOD_S * net_nm / self.inertia_kg_m2
        self.angle_rad += PERIOD_S * self.speed_rad_s


@dataclass
class Course:
    """What a plan did, one entry per cycle."""

    torque_nm: list[float] = field(default_factory=list)
    speed_rad_s: list[float] = field(default_factory=list)
    phase: list[Phase] = field(default_factory=list)

    def measured(self, values: list[float]) -> list[float]:
        """Entries of the measured part."""
        return [value for value, phase in zip(values, self.phase, strict=True) if phase is Phase.MEASURE]


def drive(experiment: Experiment, vehicle: RigidVehicle, cycles: int = 20_000) -> Course:
    """Run a plan to its end on a vehicle."""
    course = Course()
    for cycle in range(cycles):
        base = experiment.torque(cycle * PERIOD_S, vehicle.reading_rad_s)
        course.torque_nm.append(base.torque_nm)
        course.speed_rad_s.append(vehicle.speed_rad_s)
        course.phase.append(base.phase)
        if base.phase is Phase.DONE:
            return course
        vehicle.advance(base.torque_nm)
    raise AssertionError(f"not done after {cycles} cycles, in phase {course.phase[-1]}")
