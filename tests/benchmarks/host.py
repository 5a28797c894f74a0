"""The host's end of the bus as a run has it: devices opened, drives armed, the guard enabled, cycles."""

from __future__ import annotations

import subprocess
import sys
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from drivers.torque_guard import TorqueRequest
from hil.config.rig_file import Rig, read_rig
from hil.rig.addresses import with_addresses
from hil.rig.arming import ArmedDrives
from hil.rig.build import open_devices
from hil.rig.cycle import Cycle
from hil.rig.excitation import NO_TORQUE
from hil.rig.fitness import Needs
from hil.rig.pacing import Pacer
from hil.rig.plc_watch import PlcWatch
from hil.rig.stop import StopRequest
from hil.sample import SampleFlag
from hil.simulator.loopback import Address
from hil.simulator.plant import RigidPlant
from hil.simulator.rig_server import RigServer

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"
PRBS_NM = 20.0
"""Of each inverter, up and down in turn: the drives carry torque, the vehicle stays where it is."""


def example_rig(period_s: float) -> Rig:
    """The example's rig, at another period; a busy machine ends no comparison."""
    rig = read_rig(EXAMPLE)
    guard = rig.guard.model_copy(update={"feedback_timeout_s": PATIENCE_S})
    return rig.model_copy(update={"period_s": period_s, "guard": guard})


PATIENCE_S = 5.0
"""With an inverter that does not answer: the simulated ones run at ordinary priority."""


@dataclass(frozen=True, slots=True)
class Host:
    """An armed host."""

    cycle: Cycle
    watch: PlcWatch
    pacer: Pacer

    def run(self, count: int, with_plc: bool) -> None:
        """Run so many cycles: guard, both commands, SYNC, both answers; the PLC's watch before each, if asked for."""
        for number in range(count):
            tick = self.pacer.next()
            flags = self.watch.look(tick, self.cycle.speed_rad_s) if with_plc else SampleFlag.GOOD
            prbs_nm = PRBS_NM if number % 2 else -PRBS_NM
            self.cycle.step(tick, TorqueRequest(0.0, prbs_nm, 0.0, prbs_nm), 0.0, flags)


@contextmanager
def armed(rig: Rig, pacer: Pacer) -> Iterator[Host]:
    """Open a rig's devices, arm its drives and wake them up, for the time of the block."""
    with open_devices(rig) as devices:
        for inverter in (devices.m1, devices.m2):
            inverter.configure()
        status = devices.plc_loop.call(devices.plc.read_status())
        with ArmedDrives(devices, StopRequest()):
            cycle = Cycle(devices.link, devices.m1, devices.m2, devices.guard, pacer.period_ns, pacer.answer_timeout_s)
            while not cycle.answered:
                cycle.step(pacer.next(), NO_TORQUE, 0.0, SampleFlag.GOOD)
            devices.guard.enable()
            cycle.step(pacer.next(), NO_TORQUE, 0.0, SampleFlag.GOOD)
            watch = PlcWatch(devices.plc_loop, devices.plc, status, Needs(0.0), pacer.poll_patience_s)
            yield Host(cycle, watch, pacer)


@contextmanager
def served_here(rig: Rig) -> Iterator[Rig]:
    """Serve a rig from this process, on the virtual bus; yields it at its addresses."""
    server = RigServer(RigidPlant(100.0, 0.5), rig, f"virtual:{uuid.uuid4()}", Address("127.0.0.1", 0))
    with server:
        yield with_addresses(rig, server.bus_url, str(server.modbus))


@contextmanager
def served_elsewhere(rig: Rig, *options: str) -> Iterator[Rig]:
    """Serve a rig from a process of its own (``hil sim``), over loopback; yields it at its addresses."""
    if rig.period_s != read_rig(EXAMPLE).period_s:
        raise ValueError(f"expected the example's period, got {rig.period_s:g} s: hil sim reads the example's file")
    served = ("--bus", "ws://127.0.0.1:0/", "--modbus", "127.0.0.1:0")
    command = [sys.executable, "-m", "hil", "sim", str(EXAMPLE), *served, *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield with_addresses(rig, *_addresses(process.stdout.readline if process.stdout else str))
        finally:
            process.terminate()


def _addresses(line: Callable[[], str]) -> tuple[str, str]:
    word, bus, modbus = line().split()
    if word != "ready":
        raise RuntimeError(f"hil sim: expected its line 'ready', got {word!r}")
    return bus.removeprefix("bus="), modbus.removeprefix("modbus=")
