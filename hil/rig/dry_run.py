"""Run a plan on paper: what torque and speed to expect, and whether the guard would let it through.

No bus is opened. The vehicle of a dry run is one rigid inertia, J w' = T - b w, taken from the model of
``[simulation]`` or, without one, from ``[vehicle]`` with no resistance at all. Grade, dry friction and the driveline's
elasticity are left out: the speed is a first look, not a promise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Protocol

from drivers.torque_guard import Evidence, TorqueGuard, TorqueRequest
from hil.config.rig_file import Rig
from hil.rig.excitation import NO_TORQUE
from hil.rig.experiments.base import Phase
from hil.rig.pacing import FreePacer, period_ns
from hil.rig.plan import plan_run
from hil.simulator.driveline import simulation_model


@dataclass(frozen=True, slots=True)
class RigidVehicle:
    """One inertia [kg m²] with viscous friction [Nm s/rad], and where both are from."""

    inertia_kg_m2: float  # sum of the model's J_*; without a model that of [vehicle]
    friction_nm_s: float  # sum of the model's b_*; 0 without a model
    source: str  # table of the rig file that they are from, in words


@dataclass(slots=True)
class Range:
    """Smallest and largest of what it has seen."""

    low: float = math.inf  # infinite before the first value
    high: float = -math.inf  # -infinite before the first value

    def see(self, value: float) -> None:
        """Take one value."""
        self.low = min(self.low, value)
        self.high = max(self.high, value)


@dataclass(slots=True)
class Ranges:
    """What torques and speed of a run are between."""

    torque_m1_nm: Range = field(default_factory=Range)  # of inverter m1, PRBS included
    torque_m2_nm: Range = field(default_factory=Range)  # of inverter m2, PRBS included
    speed_rad_s: Range = field(default_factory=Range)  # of the whole run
    speed_measured_rad_s: Range = field(default_factory=Range)  # in the recorded part

    def see(self, phase: Phase, torque_m1_nm: float, torque_m2_nm: float, speed_rad_s: float) -> None:
        """Take one cycle."""
        self.torque_m1_nm.see(torque_m1_nm)
        self.torque_m2_nm.see(torque_m2_nm)
        self.speed_rad_s.see(speed_rad_s)
        if phase is Phase.MEASURE:
            self.speed_measured_rad_s.see(speed_rad_s)

    def as_json(self) -> dict[str, list[float]]:
        """Return the ranges of what was seen."""
        names = ("torque_m1_nm", "torque_m2_nm", "speed_rad_s", "speed_measured_rad_s")
        ranges: dict[str, Range] = {name: getattr(self, name) for name in names}
        return {name: [seen.low, seen.high] for name, seen in ranges.items() if seen.low <= seen.high}


@dataclass(slots=True, kw_only=True)
class Prediction(Ranges):
    """What to expect of a run."""

    vehicle: RigidVehicle  # the model the prediction is made with
    period_s: float  # time between two cycles [s]
    cycles: int = 0  # of the whole run
    measured: int = 0  # of these, in the recorded part
    torque_nm: Range = field(default_factory=Range)  # of the base torque of both inverters


class Vehicle(Protocol):
    """A vehicle that can be driven on paper."""

    @property
    def speed_rad_s(self) -> float:
        """Speed of the motor shaft, positive forward [rad/s]."""

    def step(self, torque_m1_nm: float, torque_m2_nm: float) -> object:
        """Advance by one cycle with the torques of both inverters [Nm]; what it returns is not used."""


def on_paper(rig: Rig, name: str, vehicle: Vehicle) -> Iterator[tuple[Phase, TorqueRequest, float]]:
    """Drive one experiment of the rig file, through the guard; yield phase, torque and speed [rad/s] of each cycle."""
    plan = plan_run(rig, name)
    guard = TorqueGuard(rig.guard_limits)
    guard.enable()
    pacer = FreePacer(period_ns(rig.period_s))
    guard.check(NO_TORQUE, pacer.next().due_ns, Evidence(0, 0, vehicle.speed_rad_s))
    phase = Phase.APPROACH
    while phase is not Phase.DONE:
        tick, speed_rad_s = pacer.next(), vehicle.speed_rad_s
        base = plan.experiment.torque((tick.cycle - 1) * rig.period_s, speed_rad_s)
        phase = base.phase
        request = plan.split.request(base.torque_nm, plan.prbs_nm(phase))
        guard.check(request, tick.due_ns, Evidence(0, 0, speed_rad_s))
        if plan.plc_prbs is not None:  # not the host's to send, but there all the same
            request = plan.split.request(base.torque_nm, plan.expected_plc_prbs_nm(phase))
        yield phase, request, speed_rad_s
        vehicle.step(request.total_m1_nm, request.total_m2_nm)


@dataclass(slots=True)
class _Rolling:
    """A rigid vehicle on its way."""

    vehicle: RigidVehicle
    period_s: float
    speed_rad_s: float = 0.0

    def step(self, torque_m1_nm: float, torque_m2_nm: float) -> None:
        torque_nm = torque_m1_nm + torque_m2_nm - self.vehicle.friction_nm_s * self.speed_rad_s
        self.speed_rad_s += self.period_s * torque_nm / self.vehicle.inertia_kg_m2


def dry_run(rig: Rig, name: str, trust_laws: bool = False) -> Prediction:
    """Predict a run of one experiment of the rig file; laws of its model's own run only where they are trusted."""
    vehicle = _rigid_vehicle(rig, trust_laws)
    prediction = Prediction(vehicle=vehicle, period_s=rig.period_s)
    for phase, request, speed_rad_s in on_paper(rig, name, _Rolling(vehicle, rig.period_s)):
        prediction.cycles += 1
        prediction.measured += phase is Phase.MEASURE
        prediction.torque_nm.see(request.base_m1_nm + request.base_m2_nm)
        prediction.see(phase, request.total_m1_nm, request.total_m2_nm, speed_rad_s)
    return prediction


def _rigid_vehicle(rig: Rig, trust_laws: bool) -> RigidVehicle:
    if rig.simulation is None:
        return RigidVehicle(rig.vehicle.inertia_kg_m2, 0.0, "[vehicle] inertia, resistance unknown")
    values = simulation_model(rig.simulation, trust_laws).values()
    inertia_kg_m2 = sum(value for name, value in values.items() if name.startswith("J_"))
    friction_nm_s = sum(value for name, value in values.items() if name.startswith("b_"))
    return RigidVehicle(inertia_kg_m2, friction_nm_s, "[simulation] model, taken as rigid")
