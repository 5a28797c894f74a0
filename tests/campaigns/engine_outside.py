"""Worlds of an engine of its own whose laws the catalogue has no entry for, one each.

A freewheel, a clutch that slips, a stiffness with an even part, a branch that relaxes, a dead band, a limit of the
torque's rate, a corrugated road, a hose and a belt with slip, each as its trade writes it. Nothing of ``estimator`` is
read here. Bus, nominal model and tests are the proof's.
"""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numba
import numpy as np

from hil.proof.truth.bus import Bus, draw_bus, draw_nominal
from hil.proof.truth.case import TESTS, Case
from hil.proof.truth.hidden import log_uniform
from hil.proof.truth.physics import FloatArray
from hil.proof.truth.specimen import Specimen, Stream, stream
from tests.campaigns.forms import Line, Role, record

ROLE = Role.JUDGE
FORM_STREAM = 11
STEPS = 100
"""Steps of a period: 0.1 ms."""


class Laws(NamedTuple):
    """Laws outside of the catalogue; each is absent at its default."""

    freewheel: float = 0.0  # share of its stiffness and damping with which a shaft still holds backwards
    slip_nm: float = 0.0  # torque beyond which a clutch in the shaft slips
    even: float = 0.0  # share by which the shaft is stiffer one way and softer the other, far from zero
    branch: float = 0.0  # stiffness of a spring and damper in series next to the shaft, over the shaft's
    branch_s: float = 1.0
    dead_nm: float = 0.0  # width to one side of a dead band of the torque
    slew_nm_s: float = 0.0  # limit of the torque's rate
    road_nm: float = 0.0  # amplitude of a wave of the load over the way
    road_rad: float = 1.0  # length of that wave, at the load
    hose_rad: float = 0.0  # twist up to which a hose is soft
    hose: float = 1.0  # share of the stiffness it has there
    belt_rad_s_nm: float = 0.0  # slip of a belt over the torque it carries


@numba.njit(cache=True)
def _shaft(p: Line, law: Laws, twist: float, rate: float, branch: float) -> float:
    spring = p.k * twist * (1.0 + law.even * math.tanh(twist / 0.02))
    if law.hose_rad > 0.0:
        inside = min(max(twist, -law.hose_rad), law.hose_rad)
        spring = p.k * (law.hose * inside + twist - inside)
    damped = p.c * rate
    if law.freewheel > 0.0 and twist < 0.0:
        spring, damped = law.freewheel * spring, law.freewheel * damped
    return spring + damped + p.k * law.branch * (twist - branch)


@numba.njit(cache=True)
def drive(p: Line, law: Laws, start_rad_s: float, torque_nm: FloatArray) -> FloatArray:
    """Return the motor's speed at the begin of each period of constant torque, shape (N,)."""
    h = 0.01 / STEPS
    speeds = np.empty(torque_nm.size)
    motor, load, way, given = start_rad_s, start_rad_s, 0.0, torque_nm[0]
    twist = (p.load_nm + p.b_L * load) / p.k
    branch = twist
    for row in range(torque_nm.size):
        speeds[row] = motor
        for _ in range(STEPS):
            wanted = torque_nm[row]
            if law.slew_nm_s > 0.0:
                wanted = given + min(max(wanted - given, -law.slew_nm_s * h), law.slew_nm_s * h)
            given = wanted
            acting = given
            if law.dead_nm > 0.0:
                acting = math.copysign(max(abs(given) - law.dead_nm, 0.0), given)
            through = _shaft(p, law, twist, motor - load, branch)
            slipping = law.slip_nm > 0.0 and abs(through) > law.slip_nm
            if slipping:
                through = math.copysign(law.slip_nm, through)
            against = p.load_nm + law.road_nm * math.sin(2.0 * math.pi * way / law.road_rad)
            motor += h * (acting - p.b_M * motor - through) / p.J_M
            load += h * (through - p.b_L * load - against) / p.J_L
            rate = motor - load - law.belt_rad_s_nm * through
            if not (slipping and through * rate > 0.0):
                twist += h * rate
            branch += h * (twist - branch) / law.branch_s
            way += h * load
    return speeds


Draw = Callable[[np.random.Generator, Bus], Laws]

LAWS: Mapping[str, Draw] = {
    "freewheel": lambda rng, bus: Laws(freewheel=log_uniform(rng, 0.005, 0.05)),
    "slipping_clutch": lambda rng, bus: Laws(slip_nm=log_uniform(rng, 120.0, 300.0)),
    "even_stiffness": lambda rng, bus: Laws(even=rng.uniform(0.3, 0.7)),
    "viscoelastic_branch": lambda rng, bus: Laws(branch=rng.uniform(0.3, 1.0), branch_s=log_uniform(rng, 0.02, 0.2)),
    "dead_band": lambda rng, bus: Laws(dead_nm=log_uniform(rng, 8.0, 40.0)),
    "slew_limit": lambda rng, bus: Laws(slew_nm_s=log_uniform(rng, 1500.0, 6000.0)),
    "corrugated_road": lambda rng, bus: Laws(
        road_nm=log_uniform(rng, 10.0, 60.0), road_rad=log_uniform(rng, 5.0, 40.0) * bus.gear_ratio
    ),
    "hose": lambda rng, bus: Laws(hose_rad=rng.uniform(0.005, 0.03), hose=rng.uniform(0.2, 0.5)),
    "belt_slip": lambda rng, bus: Laws(belt_rad_s_nm=log_uniform(rng, 0.0005, 0.005)),
}
"""What the engine conceals, each seed the next one."""

PLACES: Mapping[str, tuple[str, ...]] = {
    "freewheel": ("shaft",),
    "slipping_clutch": ("shaft",),
    "even_stiffness": ("shaft",),
    "viscoelastic_branch": ("shaft",),
    "dead_band": ("torque_path",),
    "slew_limit": ("torque_path",),
    "corrugated_road": ("load",),
    "hose": ("shaft",),
    "belt_slip": ("shaft",),
}
"""Elements at which a law is: where a diagnosis is right to look."""


def make_outside(seed: int) -> Case:
    """Draw a bus with a law outside of the catalogue, record its three tests and as many fresh ones."""
    bus, name = draw_bus(stream(seed, Stream.BUS)), list(LAWS)[seed % len(LAWS)]
    law = LAWS[name](np.random.default_rng([seed, FORM_STREAM]), bus)
    line = Line(bus.J_M, bus.J_L, bus.k, bus.c, bus.b_M, bus.b_L, bus.load_torque_nm)
    specimen = Specimen(name, seed, bus, draw_nominal(bus, stream(seed, Stream.NOMINAL)), {name: law._asdict()})

    def driven(start_rad_s: float, torque_nm: FloatArray) -> FloatArray:
        return drive(line, law, start_rad_s, torque_nm)

    seen, fresh = (tuple(record(each, test, line, driven) for test in TESTS) for each in (seed, seed + FRESH))
    return Case(specimen, seen, fresh)


FRESH = 1_000_000
"""What the seed of fresh recordings is larger by: other torques, another noise."""
