"""The documented walk-through on many seeds: ``python -m tests.benchmarks.walk_through --seeds 20``.

`hil sim` with a gap in the line, `hil run` of an experiment, `hil identify`: the example's rig, both protocol stacks,
noise and PRBS of another seed each time. The damping of the best estimate is held against that of the line without its
gap, and the verdict is printed.
"""

import argparse
import math
import sys
import tempfile
import uuid
from pathlib import Path

from estimator.identification.best import BestEstimate, best_estimate
from hil.config.rig_file import read_rig
from hil.figures.local_model import TwoMassLine
from hil.recording.signals import read_record
from hil.recording.writer import RecordingWriter
from hil.rig.build import open_devices
from hil.rig.pacing import FreePacer, device_patience_s, period_ns
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.simulator.addresses import IN_PROCESS, Address, with_addresses
from hil.simulator.driveline import EffectSpec, plant_for, simulation_model
from hil.simulator.rig_server import RigServer, required_simulation

RIG_FILE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"
GAP = "backlash:gap_rad=0.02"


def linear_truth() -> tuple[float, float]:
    """Return resonance [Hz] and damping of the simulated line without its gap."""
    mode = TwoMassLine.of(simulation_model(required_simulation(read_rig(RIG_FILE))).values()).resonance
    if mode is None:
        raise AssertionError("the example's line oscillates")
    return mode.frequency_hz, mode.damping


def walk(seed: int, recording: Path, effect: str = GAP, experiment: str = "cruise") -> BestEstimate:
    """Simulate, run, identify; the recording is a new file."""
    rig = read_rig(RIG_FILE)
    rig = rig.model_copy(update={"prbs": rig.prbs.model_copy(update={"seed": 1 + seed})})
    address = f"{IN_PROCESS}{uuid.uuid4()}"
    plant = plant_for(rig, [EffectSpec.parse(effect)], False)
    with RigServer(plant, rig, address, Address("127.0.0.1", 0), seed=seed) as server:
        served = with_addresses(rig, server.bus_url, str(server.modbus))
        pacer = FreePacer(period_ns(rig.period_s))
        opened = open_devices(served, device_patience_s(pacer))
        with RecordingWriter(recording, {}) as recorder, opened as devices:
            run_plan(devices, plan_run(served, experiment), pacer, recorder, StopRequest(), lambda phase, time_s: None)
    return best_estimate(read_record(recording))


def main() -> None:
    """Walk through with each seed and print what came out, then how many are within 15 %."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--effect", default=GAP)
    given = parser.parse_args()
    frequency_hz, damping = linear_truth()
    sys.stdout.write(f"linear: {frequency_hz:.3f} Hz, damping {damping:.4f}\n")
    within = 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(given.seeds):
            best = walk(seed, Path(folder) / f"{seed}.csv", given.effect)
            mode = best.mode
            found = f"{mode.frequency_hz.value:.3f} Hz, {mode.damping.value:.4f}" if mode else "no pair"
            off = math.inf if best.mode is None else best.mode.damping.value / damping - 1.0
            within += abs(off) <= 0.15
            sys.stdout.write(
                f"{seed:4} {best.verdict.value:12} {found} ({off:+.1%}) {best.linearity.depends_on or ''}\n"
            )
            sys.stdout.flush()
    sys.stdout.write(f"damping within 15 %: {within} of {given.seeds}\n")


if __name__ == "__main__":
    main()
