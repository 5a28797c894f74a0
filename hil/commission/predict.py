"""A run on paper: what torque and speed to expect, through the torque guard, with what is known of the driveline.

As `hil.rig.dry_run`, with the driveline of a model in place of a rigid vehicle: the PRBS makes the line ring, and the
speed band and the comfort of a run are judged before it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.torque_guard import Evidence, TorqueGuard
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.stepper import Stepper
from estimator.signals.record import FloatArray
from hil.config.rig_file import Rig
from hil.rig.dry_run import Range
from hil.rig.experiments.base import Phase
from hil.rig.pacing import FreePacer, period_ns
from hil.rig.plan import plan_run

NO_DRAG = 1e-3
"""Viscous friction of a vehicle of which only the inertia is known, over that inertia [1/s]: next to none."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """What to expect of a run.

    Attributes
    ----------
    seconds
        Length of the whole run.
    torque_m1_nm, torque_m2_nm
        Range of each inverter's torque, PRBS included.
    speed_rad_s, speed_measured_rad_s
        Range of the speed over the whole run and over its recorded part.
    last_rad_s
        Speed at the end.
    torque_nm, course_rad_s
        Total torque and speed of the recorded part, shape (N,).
    """

    seconds: float
    torque_m1_nm: Range
    torque_m2_nm: Range
    speed_rad_s: Range
    speed_measured_rad_s: Range
    last_rad_s: float
    torque_nm: FloatArray
    course_rad_s: FloatArray

    def as_json(self) -> dict[str, list[float]]:
        """Return the ranges for the state file."""
        return {
            "torque_m1_nm": [self.torque_m1_nm.low, self.torque_m1_nm.high],
            "torque_m2_nm": [self.torque_m2_nm.low, self.torque_m2_nm.high],
            "speed_rad_s": [self.speed_rad_s.low, self.speed_rad_s.high],
            "speed_measured_rad_s": [self.speed_measured_rad_s.low, self.speed_measured_rad_s.high],
        }


def rigid_model(rig: Rig) -> DrivelineModel:
    """Return what the rig file alone says of the vehicle: its inertia."""
    inertia = rig.vehicle.inertia_kg_m2
    return DrivelineModel(
        Structure.ONE_MASS, {"J_M": Parameter(inertia, 0.5), "b_M": Parameter(NO_DRAG * inertia, 0.5)}
    )


def predict(rig: Rig, name: str, model: DrivelineModel, speed_rad_s: float = 0.0) -> Prediction:
    """Predict a run of one experiment of a rig file, from standstill or rolling at a speed [rad/s].

    Raises
    ------
    CommandRefused
        If the torque guard would refuse one of its torques.
    RunAborted
        If the vehicle of the prediction does not come to the start speed.
    """
    plan = plan_run(rig, name)
    vehicle = Stepper(model, rig.period_s, speed_rad_s=speed_rad_s)
    guard = TorqueGuard(rig.guard_limits)
    guard.enable()
    pacer = FreePacer(period_ns(rig.period_s))
    guard.check(plan.split.request(0.0, 0.0), pacer.next().due_ns, Evidence(0, 0, vehicle.speed_rad_s))
    m1, m2, speed, measured = Range(), Range(), Range(), Range()
    torque: list[float] = []
    course: list[float] = []
    cycles, phase = 0, Phase.APPROACH
    while phase is not Phase.DONE:
        tick = pacer.next()
        base = plan.experiment.torque(cycles * rig.period_s, vehicle.speed_rad_s)
        phase, cycles = base.phase, cycles + 1
        request = plan.split.request(base.torque_nm, plan.prbs_nm(phase))
        guard.check(request, tick.due_ns, Evidence(0, 0, vehicle.speed_rad_s))
        if plan.plc_prbs is not None:  # not the host's to send, but there all the same
            request = plan.split.request(base.torque_nm, plan.expected_plc_prbs_nm(phase))
        m1.see(request.total_m1_nm)
        m2.see(request.total_m2_nm)
        speed.see(vehicle.speed_rad_s)
        if phase is Phase.MEASURE:
            measured.see(vehicle.speed_rad_s)
            torque.append(request.total_m1_nm + request.total_m2_nm)
            course.append(vehicle.speed_rad_s)
        vehicle.step(request.total_m1_nm, request.total_m2_nm)
    seconds = cycles * rig.period_s
    last_rad_s = vehicle.speed_rad_s
    return Prediction(seconds, m1, m2, speed, measured, last_rad_s, np.array(torque), np.array(course))
