"""``python -m tests.benchmarks.fieldbus``: the cycle on the bus: lateness, processor share, throughput.

``lateness``    how late cycles begin, next to a bare C loop of the same period and priority, in turn
``share``       processor time of the host in a 10 ms cycle with two inverters and PLC, of one core; the simulated
                devices run in another process
``throughput``  exchanges through guard, drivers and simulated drives in one process, every frame on the bus, next to
                python-can sending and receiving the same frames, in turn

What is compared is reported as ratios of one run; a time depends on the machine and on what else runs on it.
"""

import argparse
import math
import shutil
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import can

from drivers.torque_guard import TorqueRequest
from hil.config.rig_file import Rig, read_rig
from hil.rig.arming import ArmedDrives
from hil.rig.build import open_devices
from hil.rig.cycle import Cycle
from hil.rig.excitation import NO_TORQUE
from hil.rig.pacing import FreePacer, Pacer, RealTimePacer, period_ns
from hil.rig.plc_watch import Needs, PlcWatch
from hil.rig.realtime import PRIORITY, real_time
from hil.rig.stop import StopRequest
from hil.sample import SampleFlag
from hil.simulator.addresses import Address, with_addresses
from hil.simulator.rig_server import RigServer
from tests.benchmarks.ratios import machine, table, timed
from tests.simulator.rigid_plant import RigidPlant

SOURCE = Path(__file__).with_name("bare_loop.c")


@contextmanager
def compiled() -> Iterator[Path]:
    """Compile the loop, for the time of the block; needs a C compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise FileNotFoundError("expected gcc or cc for the loop to compare with, got neither: install a C compiler")
    with TemporaryDirectory(prefix="hil-bare-loop-") as folder:
        program = Path(folder) / "bare_loop"
        subprocess.run([compiler, "-O2", "-Wall", "-Werror", "-o", str(program), str(SOURCE)], check=True)
        yield program


def lateness_ns(program: Path, period_ns: int, count: int, priority: int) -> list[int]:
    """Run the loop: how late each cycle began [ns]; ``priority`` of SCHED_FIFO, 0 for ordinary scheduling."""
    command = [str(program), str(period_ns), str(count), str(priority)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return [int(line) for line in done.stdout.split()]


RPDOS, SYNC, TPDOS = (0x201, 0x202), 0x080, (0x181, 0x182)
RPDO_BYTES, TPDO_BYTES = 6, 8

Exchange = Callable[[int], None]
"""``exchange(count)``: so many cycles, one after the other."""


@contextmanager
def raw_exchange() -> Iterator[Exchange]:
    """Open the bus, and yield what sends and receives two RPDOs, SYNC and two TPDOs, all in one thread."""
    channel = str(uuid.uuid4())
    with _participant(channel) as host, _participant(channel) as drives:

        def exchange(count: int) -> None:
            for _ in range(count):
                for cob_id in RPDOS:
                    host.send(_frame(cob_id, RPDO_BYTES))
                host.send(_frame(SYNC, 0))
                _receive(drives, len(RPDOS) + 1)
                for cob_id in TPDOS:
                    drives.send(_frame(cob_id, TPDO_BYTES))
                _receive(host, len(TPDOS))

        yield exchange


def _participant(channel: str) -> can.BusABC:
    return can.Bus(interface="virtual", channel=channel, ignore_config=True)


def _frame(cob_id: int, size_bytes: int) -> can.Message:
    return can.Message(arbitration_id=cob_id, data=bytes(size_bytes), is_extended_id=False)


def _receive(bus: can.BusABC, count: int) -> None:
    for _ in range(count):
        if bus.recv(1.0) is None:
            raise TimeoutError("a frame of the raw exchange did not arrive within 1 s")


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
            cycle = Cycle(devices, pacer.period_ns, pacer.answer_timeout_s)
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


PAIRS = 3
DEFAULT_PERIOD_S, SHORTEST_PERIOD_S = 0.01, 0.001
CHUNK_S = 4.0
"""One side's turn in the comparison of lateness."""

EXCHANGES = 4000
"""Of one side's turn in the comparison of throughput."""

QUANTILES = (0.5, 0.99, 0.999)

LIMITS = {"lateness": 1.5, "share": 0.10, "throughput": 1.0 / 3.0}
"""p99 to that of the C loop at most, part of a core at most, part of raw python-can at least."""


class _Noted(RealTimePacer):
    """The pacer of a run, which keeps how late each cycle began [ns]."""

    def __init__(self, period: int) -> None:
        super().__init__(period)
        self.late_ns: list[int] = []

    def next(self):  # type: ignore[no-untyped-def]  # as the pacer's
        tick = super().next()
        self.late_ns.append(tick.late_ns)
        return tick


def quantile(values: Sequence[int], share: float) -> int:
    """Nearest rank."""
    return sorted(values)[max(0, math.ceil(share * len(values)) - 1)]


def lateness(pairs: int) -> str:
    """Compare how late cycles begin: the default period with all devices elsewhere, the shortest with the drives here.

    At the shortest period no PLC is polled: its server would be in this process and take the interpreter for itself.
    """
    rows = []
    for period_s, serve, with_plc in (
        (DEFAULT_PERIOD_S, served_elsewhere, True),
        (SHORTEST_PERIOD_S, served_here, False),
    ):
        with serve(example_rig(period_s)) as rig, compiled() as program, real_time() as grants:
            ours, theirs = [], []
            period, count = period_ns(period_s), round(CHUNK_S / period_s)
            priority = PRIORITY if grants.scheduling.given else 0
            for _ in range(pairs):
                pacer = _Noted(period)
                with armed(rig, pacer) as host:
                    pacer.late_ns.clear()
                    host.run(count, with_plc=with_plc)
                ours += pacer.late_ns
                theirs += lateness_ns(program, period, count, priority)
        for name, values in (("cycle", ours), ("C loop", theirs)):
            times = [f"{quantile(values, share) / 1e3:.0f} us" for share in QUANTILES]
            rows.append((f"{period_s * 1e3:g} ms", name, str(len(values)), *times, f"{max(values) / 1e3:.0f} us", ""))
        ratio = quantile(ours, 0.99) / quantile(theirs, 0.99)
        rows.append((f"{period_s * 1e3:g} ms", "ratio of p99", "", "", "", "", "", f"{ratio:.2f}"))
    columns = ("period", "who", "cycles", "p50", "p99", "p99.9", "max", f"ratio, at most {LIMITS['lateness']:g}")
    return f"{grants.statement}\n\n" + table(columns, rows)


def share(pairs: int) -> str:
    """Measure the host's processor time in a 10 ms cycle, PLC included."""
    rows = []
    with served_elsewhere(example_rig(DEFAULT_PERIOD_S)) as rig, real_time():
        for _ in range(pairs):
            with armed(rig, RealTimePacer(period_ns(DEFAULT_PERIOD_S))) as host:
                taken, _ = timed(lambda host=host: host.run(round(CHUNK_S / DEFAULT_PERIOD_S), with_plc=True))
            part = taken.processor_s / taken.clock_s
            rows.append((f"{taken.clock_s:.2f} s", f"{taken.processor_s:.3f} s", f"{100.0 * part:.1f} %"))
    return table(("time", "processor time of the host", f"of one core, at most {100 * LIMITS['share']:g} %"), rows)


def throughput(pairs: int) -> str:
    """Compare exchanges a second with raw python-can, the same frames, in one process."""
    rates: list[tuple[float, float, float, float]] = []
    with ExitStack() as stack:
        rig = stack.enter_context(served_here(example_rig(DEFAULT_PERIOD_S)))
        raw = stack.enter_context(raw_exchange())
        raw(EXCHANGES // 10)
        for _ in range(pairs):
            with armed(rig, FreePacer(period_ns(rig.period_s))) as host:
                host.run(EXCHANGES // 10, with_plc=False)
                ours, _ = timed(lambda host=host: host.run(EXCHANGES, with_plc=False))
            theirs, _ = timed(lambda: raw(EXCHANGES))
            times = (ours.clock_s, theirs.clock_s, ours.processor_s, theirs.processor_s)
            rates.append(tuple(EXCHANGES / seconds for seconds in times))  # type: ignore[arg-type]  # four of them
    here, there, here_busy, there_busy = (median(column) for column in zip(*rates, strict=True))
    pair_by_pair = [mine / other for _, _, mine, other in rates]
    row = (
        f"{here:.0f} /s",
        f"{there:.0f} /s",
        f"{here / there:.2f}",
        f"{here_busy / there_busy:.2f}",
        f"{min(pair_by_pair):.2f} to {max(pair_by_pair):.2f}",
        f"{here * DEFAULT_PERIOD_S:.0f}",
    )
    columns = (
        "exchanges here",
        "raw python-can",
        f"ratio, at least {LIMITS['throughput']:.2f}",
        "of processor times",
        "pair by pair",
        "times real time at 10 ms",
    )
    return table(columns, [row])


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and write the report; return the exit status."""
    parts: dict[str, Callable[[int], str]] = {"lateness": lateness, "share": share, "throughput": throughput}
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.fieldbus", description="The cycle on the bus: lateness, share, throughput."
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"{', '.join(parts)} (default: all)")
    parser.add_argument("--pairs", type=int, default=PAIRS, help="turns of each side (default: %(default)s)")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.parts if name not in parts]
    if unknown:
        parser.error(f"expected {', '.join(parts)}, got {', '.join(unknown)}")
    sys.stdout.write(f"{time.strftime('%Y-%m-%d')}, {machine()}")
    for name in options.parts or parts:
        sys.stdout.write(f"\n### {name.capitalize()}\n\n{parts[name](options.pairs)}")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
