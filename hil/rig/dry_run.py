"""Run a plan on paper: what torque and speed to expect, and whether the guard would let it through.

No bus is opened. The vehicle is one rigid inertia, J w' = T - b w, taken from the model of ``[simulation]``
or, without one, from ``[vehicle]`` with no resistance at all. Grade, dry friction and the driveline's
elasticity are left out: the speed is a first look, not a promise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from drivers.torque_guard import Evidence, TorqueGuard, TorqueRequest
from hil.config.rig_file import Rig
from hil.rig.experiments.base import Phase
from hil.rig.pacing import FreePacer, period_ns
from hil.rig.plan import plan_run
from hil.simulator.driveline import simulation_model


@dataclass(frozen=True, slots=True)
class RigidVehicle:
    """One inertia [kg m²] with viscous friction [Nm s/rad], and where both are from."""

    inertia_kg_m2: float
    friction_nm_s: float
    source: str


@dataclass(slots=True)
class Range:
    """Smallest and largest of what it has seen."""

    low: float = math.inf
    high: float = -math.inf

    def see(self, value: float) -> None:
        """Take one value."""
        self.low = min(self.low, value)
        self.high = max(self.high, value)


@dataclass(slots=True)
class Prediction:
    """What to expect of a run."""

    vehicle: RigidVehicle  # the model the prediction is made with
    period_s: float  # time between two cycles [s]
    cycles: int = 0  # cycles of the whole run and of its recorded part
    measured: int = 0  # cycles of the whole run and of its recorded part
    torque_nm: Range = field(default_factory=Range)  # range of the base torque of both inverters [Nm]
    torque_m1_nm: Range = field(default_factory=Range)  # range of each inverter's torque, PRBS included [Nm]
    torque_m2_nm: Range = field(default_factory=Range)  # range of each inverter's torque, PRBS included [Nm]
    speed_rad_s: Range = field(default_factory=Range)
    speed_measured_rad_s: Range = field(default_factory=Range)


def dry_run(rig: Rig, name: str, trust_laws: bool = False) -> Prediction:
    """Predict a run of one experiment of the rig file; laws of its model's own run only where they are trusted."""
    plan = plan_run(rig, name)
    prediction = Prediction(_rigid_vehicle(rig, trust_laws), rig.period_s)
    guard = TorqueGuard(rig.guard_limits)
    guard.enable()
    pacer = FreePacer(period_ns(rig.period_s))
    guard.check(plan.split.request(0.0, 0.0), pacer.next().due_ns, Evidence(0, 0, 0.0))
    speed_rad_s, phase = 0.0, Phase.APPROACH
    while phase is not Phase.DONE:
        tick = pacer.next()
        base = plan.experiment.torque((tick.cycle - 1) * rig.period_s, speed_rad_s)
        phase = base.phase
        request = plan.split.request(base.torque_nm, plan.prbs_nm(phase))
        guard.check(request, tick.due_ns, Evidence(0, 0, speed_rad_s))
        if plan.plc_prbs is not None:  # not the host's to send, but there all the same
            request = plan.split.request(base.torque_nm, plan.expected_plc_prbs_nm(phase))
        _note(prediction, phase, request, speed_rad_s)
        speed_rad_s = _next_speed(prediction.vehicle, rig.period_s, speed_rad_s, request)
    return prediction


def _rigid_vehicle(rig: Rig, trust_laws: bool) -> RigidVehicle:
    if rig.simulation is None:
        return RigidVehicle(rig.vehicle.inertia_kg_m2, 0.0, "[vehicle] inertia, resistance unknown")
    values = simulation_model(rig.simulation, trust_laws).values()
    inertia_kg_m2 = sum(value for name, value in values.items() if name.startswith("J_"))
    friction_nm_s = sum(value for name, value in values.items() if name.startswith("b_"))
    return RigidVehicle(inertia_kg_m2, friction_nm_s, "[simulation] model, taken as rigid")


def _next_speed(vehicle: RigidVehicle, period_s: float, speed_rad_s: float, request: TorqueRequest) -> float:
    torque_nm = request.total_m1_nm + request.total_m2_nm
    return speed_rad_s + period_s * (torque_nm - vehicle.friction_nm_s * speed_rad_s) / vehicle.inertia_kg_m2


def _note(prediction: Prediction, phase: Phase, request: TorqueRequest, speed_rad_s: float) -> None:
    prediction.cycles += 1
    prediction.torque_nm.see(request.base_m1_nm + request.base_m2_nm)
    prediction.torque_m1_nm.see(request.total_m1_nm)
    prediction.torque_m2_nm.see(request.total_m2_nm)
    prediction.speed_rad_s.see(speed_rad_s)
    if phase is Phase.MEASURE:
        prediction.measured += 1
        prediction.speed_measured_rad_s.see(speed_rad_s)
