"""Two simulated inverters and a plant on a bus, driven by SYNC: one SYNC is one period of simulated time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, Self, runtime_checkable

from drivers.canopen import can
from drivers.canopen.can_link import SYNC_COB_ID, CanLink
from estimator.signals.record import Location, OutputKind
from hil.simulator.drive_physics import SimulatedInverter
from hil.simulator.inverter_node import InverterNode


class SimulatedPlant(Protocol):
    """A driveline as the simulated rig sees it; all values reflected to the motor shaft."""

    @property
    def speed_rad_s(self) -> float:
        """True motor speed now [rad/s]."""

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Let the plant run with both inverters' torques held [Nm] for ``duration_s`` [s]."""


@runtime_checkable
class SensedPlant(SimulatedPlant, Protocol):
    """A driveline with further places to measure at."""

    def measured(self, kind: OutputKind, at: Location) -> float:
        """Return what a sensor there shows now [rad/s, rad, Nm, rad/s^2]."""


StepCallback = Callable[[float], None]  # ``callback(time_s)``, called in the rig's own thread after each step

TorqueSource = Callable[[], tuple[float, float]]
"""What another controller adds to the torque references of m1 and m2 [Nm], asked at each SYNC."""


class SimulatedRig:
    """The slaves' end of a bus.

    At each SYNC both inverters put the torque of their last RPDO into effect, both send their TPDO with the
    speed and torque of this moment, then the plant runs for one period. The same seed and commands give the
    same TPDOs, byte for byte.
    """

    def __init__(
        self,
        bus: can.BusABC,  # An open ``python-can`` bus; it belongs to the rig from now on
        plant: SimulatedPlant,  # What the inverters drive
        inverters: tuple[SimulatedInverter, SimulatedInverter],  # Inverters m1 and m2
        period_s: float = 0.01,  # Simulated time of one SYNC [s]
        seed: int = 0,  # Of all reading noise
        real_time: bool = False,
    ) -> None:
        self._plant = plant
        self._period_s = period_s
        self._callbacks: list[StepCallback] = []
        self._sensors: list[Callable[[], None]] = []
        self._added: TorqueSource = lambda: (0.0, 0.0)
        self._steps = 0
        self._link = CanLink(bus)
        m1, m2 = inverters
        self._m1 = None if m1.faults.absent else InverterNode(self._link, m1, seed, real_time)
        self._m2 = None if m2.faults.absent else InverterNode(self._link, m2, seed, real_time)
        self._nodes = tuple(node for node in (self._m1, self._m2) if node is not None)
        self._link.subscribe(SYNC_COB_ID, self._on_sync)

    @property
    def time_s(self) -> float:
        """Simulated time since the start [s]."""
        return self._steps * self._period_s

    @property
    def torque_nm(self) -> tuple[float, float]:
        """Torques in effect now [Nm]; an absent inverter gives none."""
        return (0.0 if self._m1 is None else self._m1.torque_nm, 0.0 if self._m2 is None else self._m2.torque_nm)

    def add_step_callback(self, callback: StepCallback) -> None:
        """Have ``callback(time_s)`` called after each step, in the rig's own thread."""
        self._callbacks.append(callback)

    def add_sensor(self, sample: Callable[[], None]) -> None:
        """Have ``sample()`` called at each SYNC, before any node answers it."""
        self._sensors.append(sample)

    def add_torque_from(self, source: TorqueSource) -> None:
        """Let another controller add to both torque references, past CANopen, such as a PLC its own PRBS."""
        self._added = source

    def close(self) -> None:
        """Take the slaves off the bus and shut it down."""
        for node in self._nodes:
            node.close()
        self._link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _on_sync(self, data: bytes, t_ns: int) -> None:
        speed_rad_s = self._plant.speed_rad_s
        for node, added_nm in zip((self._m1, self._m2), self._added(), strict=True):
            if node is not None:
                node.add_torque(added_nm)
        for node in self._nodes:
            node.step(t_ns, speed_rad_s, self._period_s)
        for sample in self._sensors:
            sample()
        for node in self._nodes:
            node.send_feedback()
        self._plant.advance(self.torque_nm, self._period_s)
        self._steps += 1
        for callback in self._callbacks:
            callback(self.time_s)
