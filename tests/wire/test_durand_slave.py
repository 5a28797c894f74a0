"""Two CiA 402 drives on another CANopen stack, ``durand``: found by the EDS it writes, configured, driven, disarmed.

``durand`` is a stack for slaves, in Python, which shares no code with this program's: its own SDO server, PDOs, NMT,
heartbeat and EDS. The state machine of CiA 402 is written here anew. CANopenNode and Lely, in C, are in no package of
Debian or PyPI.
"""

import math
import threading
import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import can
import pytest

from drivers.inverter.cia402 import PowerState
from hil.config.rig_file import Rig
from hil.rig.build import open_devices
from hil.rig.pacing import FREE_PATIENCE_S
from hil.simulator.rig_server import RigServer
from tests.drivers.maker_rig import written_rig
from tests.rig.serving import ANY_PORT, Samples, changed, run
from tests.simulator.rigid_plant import RigidPlant

durand = pytest.importorskip("durand", reason="the stack durand is not installed (pip install durand)")

RATED_NM = 600.0
RPM = 60.0 / (2.0 * math.pi)
DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP = 0x0250, 0x0231, 0x0233, 0x1237, 0x0217
"""Statuswords, with remote and voltage enabled; the target is followed where operation is enabled."""


def next_statusword(status: int, command: int) -> int:
    """CiA 402-2, table of transitions, without faults."""
    if command & 0x02 == 0:
        return DISABLED
    if command & 0x04 == 0:
        return QUICK_STOP if status == ENABLED else DISABLED
    if command & 0x07 == 0x06:
        return status if status == QUICK_STOP else READY
    if status in (READY, ENABLED) and command & 0x0F == 0x07:
        return SWITCHED_ON
    return ENABLED if status == SWITCHED_ON and command & 0x0F == 0x0F else status


class WallClock(durand.scheduler.AbstractScheduler):  # type: ignore[misc, name-defined]
    """The stack's own schedulers want a loop of the program; this one has a thread for each call."""

    def __init__(self) -> None:
        self._lock = threading.Lock()

    def add(self, delay: float, callback: Callable[..., None], args: Any = (), kwargs: Any = None) -> threading.Timer:
        timer = threading.Timer(delay, callback, args, kwargs)
        timer.daemon = True
        timer.start()
        return timer

    def cancel(self, entry: threading.Timer) -> None:
        entry.cancel()

    @property
    def lock(self) -> threading.Lock:
        return self._lock


class Shaft:
    """The one shaft of both drives: driven on once each has given its torque for a SYNC."""

    def __init__(self, period_s: float) -> None:
        self._plant, self._period_s = RigidPlant(10.0, 0.5), period_s
        self._given: dict[int, float] = {}
        self._lock = threading.Lock()
        self.torques_nm: list[tuple[float, float]] = []

    def take(self, node_id: int, torque_nm: float) -> float:
        with self._lock:
            self._given[node_id] = torque_nm
            if len(self._given) == 2:
                self.torques_nm.append((self._given[1], self._given[2]))
                self._plant.advance(self.torques_nm[-1], self._period_s)
                self._given = {}
            return self._plant.speed_rad_s


OBJECTS = (
    (0x603F, "UNSIGNED16", "ro", 0, "Error code"),
    (0x6007, "INTEGER16", "rw", 2, "Abort connection option code"),
    (0x6040, "UNSIGNED16", "rw", 0, "Controlword"),
    (0x6041, "UNSIGNED16", "ro", DISABLED, "Statusword"),
    (0x6060, "INTEGER8", "rw", 0, "Modes of operation"),
    (0x6061, "INTEGER8", "ro", 0, "Modes of operation display"),
    (0x606C, "INTEGER32", "ro", 0, "Velocity actual value"),
    (0x6071, "INTEGER16", "rw", 0, "Target torque"),
    (0x6072, "UNSIGNED16", "rw", 1000, "Max torque"),
    (0x6076, "UNSIGNED32", "rw", round(1000.0 * RATED_NM), "Motor rated torque"),
    (0x6077, "INTEGER16", "ro", 0, "Torque actual value"),
    (0x60A9, "UNSIGNED32", "rw", 0xFDB44700, "SI unit velocity"),
    (0x60B2, "INTEGER16", "rw", 0, "Torque offset"),
    (0x6502, "UNSIGNED32", "ro", 1 << 9, "Supported drive modes"),
)


class Drive:
    """One drive: objects of CiA 402 in a node of the stack."""

    def __init__(self, bus: can.BusABC, node_id: int, shaft: Shaft) -> None:
        self.network = durand.CANBusNetwork(bus)
        self.node = node = durand.MinimalNode(self.network, node_id)
        self._od, self._shaft, self._node_id = node.object_dictionary, shaft, node_id
        for index, kind, access, value, name in OBJECTS:
            self._od[index] = durand.Variable(durand.DatatypeEnum[kind], access, value, name=name)
        identity = self._od[0x1018]
        identity[1].value, identity[2].value, identity[4].value = 0x3E7, 0x402, node_id
        node.rpdo[0].mapping = [(0x6040, 0), (0x6071, 0), (0x60B2, 0)]
        node.tpdo[0].mapping = [(0x6041, 0), (0x6077, 0), (0x606C, 0)]
        node.rpdo[0].transmission_type = node.tpdo[0].transmission_type = 1
        self._od.download_callbacks[(0x6040, 0)].add(self._command)
        self._od.download_callbacks[(0x6060, 0)].add(lambda mode: self._od.write(0x6061, 0, mode))
        node.sync.callbacks.add(self._step)

    @property
    def status(self) -> int:
        return int(self._od.read(0x6041, 0))

    def _command(self, command: int) -> None:
        self._od.write(0x6041, 0, next_statusword(self.status, command))

    def _step(self) -> None:
        torque = self._od.read(0x6071, 0) + self._od.read(0x60B2, 0) if self.status == ENABLED else 0
        speed_rad_s = self._shaft.take(self._node_id, torque * RATED_NM / 1000.0)
        self._od.write(0x6077, 0, torque)
        self._od.write(0x606C, 0, round(1000.0 * RPM * speed_rad_s))


@contextmanager
def drives(channel: str, shaft: Shaft) -> Iterator[tuple[Drive, Drive]]:
    """Both on one virtual channel, each with a thread of the stack that receives for it."""
    durand.scheduler.set_scheduler(WallClock())
    with ExitStack() as stack:
        made = []
        for node_id in (1, 2):
            bus = stack.enter_context(can.Bus(channel, interface="virtual"))
            made.append(Drive(bus, node_id, shaft))
            stack.callback(made[-1].network.stop)
            stack.callback(made[-1].node.object_dictionary.write, 0x1017, 0, 0)
        yield made[0], made[1]


def rig_of(content: str, folder: Path) -> Rig:
    """The rig file that the program writes for the EDS of the stack, with a short cruise."""
    eds = folder / "durand.eds"
    eds.write_text(content, encoding="utf-8")
    quick = {
        "vehicle": {"inertia_kg_m2": 10.0},
        "experiments.cruise": {"duration_s": 1.0, "speed_rad_s": 0.4, "approach_timeout_s": 20.0},
    }
    rig: Rig = changed(written_rig(eds, folder), quick)
    return rig


def test_it_is_found_configured_driven_through_a_run_and_disarmed(tmp_path: Path) -> None:
    channel = str(uuid.uuid4())
    shaft = Shaft(0.01)
    with drives(channel, shaft) as (m1, m2), ExitStack() as stack:
        rig = rig_of(m1.node.eds.content, tmp_path)
        nobody = changed(rig, {"inverters.m1": {"node_id": 11}, "inverters.m2": {"node_id": 12}})
        server = stack.enter_context(RigServer(RigidPlant(10.0, 0.5), nobody, f"virtual:{channel}", ANY_PORT))
        at = changed(
            rig,
            {"can": {"url": f"virtual:{channel}"}, "plc": {"host": server.modbus.host, "port": server.modbus.port}},
        )
        kept = Samples()
        with open_devices(at, FREE_PATIENCE_S) as devices:
            assert (*devices.m1.check(), *devices.m2.check()) == ()
            summary = run(at, devices, kept)
            after = [PowerState.SWITCH_ON_DISABLED, PowerState.SWITCH_ON_DISABLED]
            assert [each._power.state() for each in (devices.m1, devices.m2)] == after
    assert summary.recorded == 100
    assert (m1.status, m2.status) == (DISABLED, DISABLED)
    references, readings = kept.column("torque_ref_m1_nm"), kept.column("torque_m1_nm")
    assert max(map(abs, references)) > 50.0, "the PRBS"
    assert readings[2:] == pytest.approx(references[1:-1], abs=0.6), "a cycle later, to a count"
    assert shaft.torques_nm[-1] == (0.0, 0.0)
