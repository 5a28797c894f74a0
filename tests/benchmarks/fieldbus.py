"""``python -m tests.benchmarks.fieldbus``: the cycle on the bus: lateness, processor share, throughput.

``lateness``    how late cycles begin, next to a bare C loop of the same period and priority, in turn
``share``       processor time of the host in a 10 ms cycle with two inverters and PLC, of one core; the simulated
                devices run in another process
``throughput``  exchanges through guard, drivers and simulated drives in one process, every frame on the bus, next to
                python-can sending and receiving the same frames, in turn

What is compared is reported as ratios of one run; a time depends on the machine and on what else runs on it.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from statistics import median

from hil.rig.pacing import FreePacer, RealTimePacer, period_ns
from hil.rig.realtime import PRIORITY, real_time
from tests.benchmarks.bare_loop import compiled, lateness_ns
from tests.benchmarks.host import armed, example_rig, served_elsewhere, served_here
from tests.benchmarks.ratios import machine, table, timed
from tests.benchmarks.raw_can import raw_exchange

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
