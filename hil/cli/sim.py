"""``hil sim``: serve the simulated slaves until stopped."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil.cli.completion import effect_names
from hil.cli.options import TrustLaws
from hil.cli.printing import say
from hil.rig.stop import StopRequest, stop_on_signals
from hil.simulator.fault_table import known_faults

if TYPE_CHECKING:
    from hil.config.rig_file import Rig
    from hil.simulator.addresses import Address
    from hil.simulator.rig_server import RigServer

LOOK_EVERY_S = 0.1
"""How soon a signal is answered [s]."""

app = typer.Typer(add_completion=False)


@app.command(
    epilog="Example: hil sim examples/rig.toml --bus ws://127.0.0.1:0/ --modbus 127.0.0.1:0"
    " --effect backlash:gap_rad=0.02 --fault plc.clutch_closes@5.0"
)
def sim(
    rig: Annotated[Path, typer.Argument(metavar="RIG", help="Rig file with a table [simulation].")],
    bus: Annotated[
        str | None,
        typer.Option(
            metavar="URL", help="Serve the CAN bus at ws://127.0.0.1:PORT/ or socketcan:vcan0; else as in RIG."
        ),
    ] = None,
    modbus: Annotated[
        str | None,
        typer.Option(metavar="HOST:PORT", help="Serve the PLC here; else where RIG says."),
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[:k=v,...]",
            help="Put an effect into the driveline; may be repeated.",
            autocompletion=effect_names,
        ),
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SPEC",
            help=f"Let a device fail, where given after S seconds of simulated time: {known_faults()}. "
            "May be repeated.",
        ),
    ] = None,
    real_time: Annotated[
        bool,
        typer.Option(
            "--real-time",
            help="Drives watch for the host's commands by the wall clock, as real ones do, and not by simulated time, "
            "which stands still with the host. For hosts that keep the period.",
        ),
    ] = False,
    trust_laws: TrustLaws = False,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of all noise; else the rig file's.")] = None,
) -> None:
    """Serve two inverters, the PLC and the driveline to other programs on this machine.

    Prints one line, `ready bus=... modbus=...`, and runs until SIGINT or SIGTERM. Port 0 takes a free one. Its time
    passes with the host's SYNC alone: between two runs the vehicle stands still where, and as fast as, it was.
    """
    from hil.config.rig_file import read_rig
    from hil.simulator.driveline import EffectSpec, plant_for
    from hil.simulator.fault_table import rig_faults
    from hil.simulator.rig_server import RigServer

    rig_file = read_rig(rig)
    effects = [EffectSpec.parse(text) for text in effect or ()]
    server = RigServer(
        plant=plant_for(rig_file, effects, trust_laws),
        rig=rig_file,
        bus_url=rig_file.can.url if bus is None else bus,
        modbus=_modbus(rig_file, modbus),
        faults=rig_faults(fault or (), rig_file.period_s),
        seed=seed,
        real_time=real_time,
    )
    _serve(server)


def _modbus(rig: Rig, given: str | None) -> Address:
    from hil.simulator.addresses import Address, modbus_address

    return modbus_address(str(Address(rig.plc.host, rig.plc.port)) if given is None else given)


def _serve(server: RigServer) -> None:
    stop = StopRequest()
    with stop_on_signals(stop), server:
        print(f"ready bus={server.bus_url} modbus={server.modbus}", flush=True)  # noqa: T201 - the contract's line
        if sys.stderr.isatty():
            say("its time passes with a host's SYNC: between two runs the vehicle stays as it is", err=True)
        while not stop.requested:
            time.sleep(LOOK_EVERY_S)
