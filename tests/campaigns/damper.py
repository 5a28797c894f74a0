"""``python -m tests.campaigns.damper [FIRST BEYOND]``: simulated buses, damped by a design that knows them about.

Each bus is drawn anew, and its model file is off by up to 2 % in every value, with a tolerance of 2 %. The designed
feedback is driven by what drives it in a run (``hil.rig.damper``), with the PRBS, noise and resolution of the example
rig, on the simulated driveline; resonance and damping are then measured from PRBS to speed with the loop closed.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from estimator.damper import PARAMETERS, Damper, Demand, Loop, Region, Timing, design_damper
from estimator.errors import BadSetting
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.signals.prbs import prbs_nm
from hil.config.damper_file import DesignedFor
from hil.design.damper import Order, file_of
from hil.rig.damper import Damping
from hil.rig.experiments.base import Phase
from hil.rig.live import LiveEstimate, tracking_chain
from hil.sample import Sample, SampleFlag
from hil.simulator.driveline import DEFAULT_BUS, DrivelinePlant

BUSES, CYCLES, PERIOD_S = 50, 3000, 0.01
TOLERANCE, TARGET, LIMIT_NM, PRBS_NM = 0.02, 0.3, 160.0, 80.0
NOISE_RAD_S, STEP_NM = 0.05, 0.6


@dataclass(frozen=True)
class Driven:
    """One bus: what was predicted for the model, what the bus itself should have, and what was measured."""

    predicted: float
    of_the_bus: float
    measured: float
    largest_rad_s: float
    off: str


def bus(seed: int) -> tuple[dict[str, float], dict[str, float]]:
    """Draw a bus, and what its model file says."""
    random = np.random.default_rng(seed)
    usual = DEFAULT_BUS.values()
    spread = {"J_M": 0.3, "J_L": 0.3, "k": 0.3, "c": 0.3, "b_M": 0.3, "b_L": 0.3}
    true = {name: usual[name] * (1.0 + random.uniform(-spread[name], spread[name])) for name in PARAMETERS}
    return true, {name: value * (1.0 + random.uniform(-TOLERANCE, TOLERANCE) / 1.02) for name, value in true.items()}


def region(model: dict[str, float]) -> Region:
    """Return the lines that a model file leaves possible."""
    low, high = ({name: value * (1.0 + sign * TOLERANCE) for name, value in model.items()} for sign in (-1.0, 1.0))
    return Region(model, low, high)


def designed(model: dict[str, float]) -> Damper:
    """Design the damper of a model file."""
    excitation = prbs_nm(2046, PRBS_NM, clock_divider=2)
    return design_damper(region(model), Timing(PERIOD_S, PERIOD_S), Demand(TARGET, LIMIT_NM, excitation))


def damping_of(damper: Damper) -> Damping:
    """Return what drives a design in a run."""
    demand = Demand(TARGET, LIMIT_NM, np.empty(0))
    rig = DesignedFor.model_validate(
        {"name": "campaign", "torque_limit_m1_nm": 400.0, "torque_limit_m2_nm": 400.0, "prbs_limit_nm": 120.0}
        | {"limit_nm": LIMIT_NM}
    )
    file = file_of(damper, region(damper.line), Order(PERIOD_S, demand, rig), "bus.toml")
    return Damping(file, rig, LiveEstimate(tracking_chain(PERIOD_S)))


def drive(true: dict[str, float], damping: Damping, seed: int, cycles: int = CYCLES) -> float:
    """Drive a bus with PRBS and damper; return the largest speed against its mean [rad/s]."""
    plant = DrivelinePlant(
        DrivelineModel(Structure.TWO_MASS, parameters={name: Parameter(value, 0.0) for name, value in true.items()}),
        PERIOD_S,
    )
    random, prbs = np.random.default_rng(1000 + seed), prbs_nm(cycles, PRBS_NM, clock_divider=2).tolist()
    largest = 0.0
    for k, level in enumerate(prbs):
        torque = STEP_NM * round((level + damping.torque_nm(k)) / STEP_NM)
        reading = plant.speed_rad_s + NOISE_RAD_S * random.standard_normal()
        largest = max(largest, abs(reading))
        sample = Sample(k, k, k * PERIOD_S, 0.0, 0.0, level, 0.5 * torque, 0.5 * torque, reading, 0, SampleFlag.GOOD)
        damping.live(sample)
        damping(sample, Phase.MEASURE)
        plant.advance((0.5 * torque, 0.5 * torque), PERIOD_S)
    return largest


def driven(seed: int) -> Driven:
    """Design for one bus and drive it."""
    true, model = bus(seed)
    damper = designed(model)
    damping = damping_of(damper)
    largest = drive(true, damping, seed)
    loop = Loop([true], damper.timing)
    own = float(loop.modes(damper.filter)[1][0])
    mode = damping.measured()
    measured = float("nan") if mode is None else mode.damping.value
    return Driven(damping.file.nominal[1].damping, own, measured, largest, damping.off)


def main() -> None:
    """Drive all of them and print the table."""
    rows, refused = [], []
    print("bus  predicted  of the bus  measured  error of the prediction  largest speed  switched off")
    for seed in range(*map(int, sys.argv[1:] or (str(BUSES),))):
        try:
            row = driven(seed)
        except BadSetting as error:
            refused.append(seed)
            print(f"{seed:3}  {error}")
            continue
        rows.append(row)
        error = row.measured / row.predicted - 1.0
        print(
            f"{seed:3}  {row.predicted:9.3f}  {row.of_the_bus:10.3f}  {row.measured:8.3f}  {100.0 * error:+21.1f} %  "
            f"{row.largest_rad_s:13.1f}  {row.off or 'no'}",
            flush=True,
        )
    errors = np.array([abs(row.measured / row.predicted - 1.0) for row in rows])
    unstable = sum(row.of_the_bus <= 0.0 or row.largest_rad_s > 50.0 for row in rows)
    print(
        f"{len(rows)} buses, {len(refused)} refused: predicted within 10 % in {int((errors < 0.1).sum())}, "
        f"median error {100.0 * float(np.median(errors)):.1f} %, largest {100.0 * float(np.max(errors)):.1f} %; "
        f"unstable {unstable}, "
        f"switched off {sum(bool(row.off) for row in rows)}"
    )


if __name__ == "__main__":
    main()
