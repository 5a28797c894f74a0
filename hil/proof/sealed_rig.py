"""``python -m hil.proof.sealed_rig --seed N``: a simulated rig that keeps its truth until it is asked.

It prints one line when it can be reached::

    ready bus=ws://127.0.0.1:41003/ modbus=127.0.0.1:36401 commitment=5f0c...

and then waits: the line ``open`` on standard input makes it print the opened seal (one line of JSON, see
`hil.proof.seal`); the end of standard input, SIGINT or SIGTERM end it. The tool under test gets the two
addresses and the nominal model (``--model``), nothing else.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from drivers.errors import DriverError
from hil.config.rig_file import Rig, read_rig
from hil.errors import HilError
from hil.proof.make_case import model_toml
from hil.proof.seal import Seal, seal
from hil.proof.truth.driveline import TruthDriveline
from hil.proof.truth.specimen import Specimen, Stream, choose_effect, draw_specimen, stream
from hil.simulator.addresses import modbus_address
from hil.simulator.fault_table import rig_faults
from hil.simulator.rig_server import RigServer

RIG_FILE = Path(__file__).with_name("demo_rig.toml")
"""The rig the challenge stands in, where no other is named."""

OPEN = "open"  # the line that opens the seal

_BAD_INPUT = 2

CONCEALED = (
    "none",
    "coulomb_friction_motor",
    "stribeck_friction",
    "backlash",
    "stiffness_nonlinearity",
    "actuator_lag",
    "transport_delay",
    "road_grade",
)
"""What may sit in the rig of the demo; "none" is as likely as any other."""


@dataclass(frozen=True, slots=True)
class Challenge:
    """A specimen at rest, ready to be driven, the faults of the devices it is driven by, and its seal."""

    specimen: Specimen  # what is hidden in which bus
    plant: TruthDriveline  # its physics, at standstill
    faults: tuple[str, ...]  # as hil sim takes them
    seal: Seal  # of specimen and faults


def draw_challenge(
    seed: int,
    effect: str | None = None,
    faults: Sequence[str] = (),
    *,
    on_rollers: bool = False,
    moments_after_s: float = 0.0,
) -> Challenge:
    """Draw a challenge; without an effect one of `CONCEALED` is drawn.

    The rolling resistance of the truth is a constant torque, as while the bus rolls forward. At standstill it would
    push the bus backwards; rollers that make up for it take it away. Moments of events and courses over time count from
    ``moments_after_s``: they are drawn for a recording, which begins after the way to its speed.
    """
    name = choose_effect(CONCEALED, seed) if effect is None else effect
    specimen = draw_specimen(name, seed)
    physics = specimen.physics(stream(seed, Stream.RECORDING))
    if on_rollers:
        physics = physics._replace(load_torque_nm=0.0)
    truth = {**specimen.truth(), "faults": list(faults)}
    plant = TruthDriveline(physics, still_s=moments_after_s)
    return Challenge(specimen, plant, tuple(faults), seal(truth))


def compile_truth(challenge: Challenge) -> None:
    """Compile the simulator now: its first step would otherwise let a device be late for its SYNC."""
    TruthDriveline(challenge.plant.physics).advance((0.0, 0.0), 1e-3)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m hil.proof.sealed_rig", description="Serve a simulated rig with a concealed effect."
    )
    parser.add_argument("--seed", required=True, type=int, help="what everything is drawn from, 0 or more")
    parser.add_argument("--effect", help=f"conceal this one; otherwise one of {', '.join(CONCEALED)} is drawn")
    parser.add_argument("--fault", action="append", default=[], metavar="SPEC", help="as hil sim takes it; repeatable")
    parser.add_argument("--on-rollers", action="store_true", help="without rolling resistance: it begins at standstill")
    parser.add_argument(
        "--moments-after-s", type=float, default=0.0, metavar="S", help="when moments drawn for a recording count from"
    )
    parser.add_argument("--rig", type=Path, default=RIG_FILE, help="rig file the simulated devices agree with")
    parser.add_argument("--bus", default="ws://127.0.0.1:0/", help="where the CAN bus is served")
    parser.add_argument("--modbus", default="127.0.0.1:0", help="where the PLC is served")
    parser.add_argument("--model", type=Path, help="write the nominal model to this file before it is ready")
    return parser


def serve(challenge: Challenge, rig: Rig, bus_url: str, modbus: str, asked: TextIO, answers: TextIO) -> None:
    """Serve a challenge until ``asked`` ends; see the module's text for what is read and written."""
    compile_truth(challenge)
    faults = rig_faults(challenge.faults, rig.period_s)
    address, seed = modbus_address(modbus), challenge.specimen.seed
    with RigServer(challenge.plant, rig, bus_url, address, faults, seed) as server:
        commitment = challenge.seal.commitment
        _tell(answers, f"ready bus={server.bus_url} modbus={server.modbus} commitment={commitment}")
        for line in asked:
            _tell(answers, _answer(line.strip(), challenge))


def _answer(asked: str, challenge: Challenge) -> str:
    if asked == OPEN:
        return json.dumps(challenge.seal.opened())
    return json.dumps({"error": f"expected the line {OPEN!r} or the end of input, got {asked!r}"})


def _tell(answers: TextIO, line: str) -> None:
    answers.write(f"{line}\n")
    answers.flush()


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve one challenge; return the exit status."""
    options = _parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with suppress(KeyboardInterrupt):
        try:
            rig = read_rig(options.rig)
            drawn = {"on_rollers": options.on_rollers, "moments_after_s": options.moments_after_s}
            challenge = draw_challenge(options.seed, options.effect, options.fault, **drawn)
            if options.model is not None:
                options.model.write_text(model_toml(challenge.specimen), encoding="utf-8")
            serve(challenge, rig, options.bus, options.modbus, sys.stdin, sys.stdout)
        except (HilError, DriverError, OSError) as error:
            sys.stderr.write(f"error: {error}\n")
            return _BAD_INPUT
    return 0


if __name__ == "__main__":
    sys.exit(main())
