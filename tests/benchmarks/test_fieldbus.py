"""The fieldbus benchmarks compare like with like: the same frames, the same schedule. No time is judged."""

import shutil
from collections import Counter

import can
import pytest

from hil.rig.pacing import FreePacer, period_ns
from tests.benchmarks import fieldbus as raw_can
from tests.benchmarks.fieldbus import DEFAULT_PERIOD_S, armed, compiled, example_rig, lateness_ns, served_here

CYCLES = 20
CYCLIC = {raw_can.SYNC, *raw_can.RPDOS, *raw_can.TPDOS}


def drained(bus: can.BusABC) -> Counter[int]:
    """Cyclic frames that wait on a bus, by identifier; heartbeats come when they come."""
    seen: Counter[int] = Counter()
    while (message := bus.recv(0.0)) is not None:
        seen[message.arbitration_id] += message.arbitration_id in CYCLIC
    return +seen


def test_both_sides_put_the_same_frames_on_the_bus() -> None:
    with served_here(example_rig(DEFAULT_PERIOD_S)) as rig:
        channel = rig.can.url.removeprefix("virtual:")
        with (
            can.Bus(interface="virtual", channel=channel, ignore_config=True) as listener,
            armed(rig, FreePacer(period_ns(rig.period_s))) as host,
        ):
            drained(listener)
            host.run(CYCLES, with_plc=False)
            ours = drained(listener)
    assert ours == Counter(dict.fromkeys(CYCLIC, CYCLES))


def test_raw_exchange_of_python_can_comes_to_its_end() -> None:
    with raw_can.raw_exchange() as exchange:
        exchange(CYCLES)


@pytest.mark.skipif(not (shutil.which("gcc") or shutil.which("cc")), reason="no C compiler (apt-get install gcc)")
def test_bare_loop_tells_the_lateness_of_every_cycle() -> None:
    with compiled() as program:
        late_ns = lateness_ns(program, 1_000_000, CYCLES, priority=0)
    assert len(late_ns) == CYCLES
    assert min(late_ns) >= 0  # it never begins a cycle before it is due
