"""A simulated rig and a host on one virtual bus, for the tests of both ends."""

import itertools
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import NoReturn

import can

from drivers.canopen.can_link import CanLink
from drivers.inverter.inverter import Inverter, InverterFeedback, InverterSettings
from drivers.torque_guard import ErrorLimits, Evidence, GuardedTorque, GuardLimits, TorqueGuard, TorqueRequest
from hil.simulator.drive_physics import SimulatedInverter
from hil.simulator.faults import InverterFaults
from hil.simulator.simulated_rig import SimulatedPlant, SimulatedRig
from tests.simulator.rigid_plant import RigidPlant

_channels = itertools.count()

M1 = InverterSettings(
    name="m1",
    node_id=5,
    rated_torque_nm=600.0,
    torque_limit_nm=400.0,
    heartbeat_ms=10,
    sdo_timeout_s=2.0,
    mode_timeout_s=1.0,
    state_timeout_s=1.0,
)
"""Patient, for a loaded machine is slow and not at fault."""

HASTY_M1 = replace(M1, sdo_timeout_s=0.02)
"""For a device that will not answer however long one waits."""

M2 = replace(M1, name="m2", node_id=6)
SIMULATED_M1 = SimulatedInverter(M1.node_id)
SIMULATED_M2 = SimulatedInverter(M2.node_id)


def virtual_bus(channel: str) -> can.BusABC:
    return can.Bus(interface="virtual", channel=channel, ignore_config=True)


def new_channel() -> str:
    return f"test-{next(_channels)}"


FRESH = Evidence(0, 0, 0.0)


def guard_limits(torque_nm: float, rate_nm_per_s: float = 1.0) -> GuardLimits:
    """Limits of which all torques have one size."""
    error = ErrorLimits(torque_nm, torque_nm, torque_nm, 1.0, 1.0)
    return GuardLimits(torque_nm, torque_nm, torque_nm, rate_nm_per_s, torque_nm, 1.0, 1.0, math.inf, 1.0, error)


def guarded(base_nm: float, prbs_nm: float = 0.0) -> GuardedTorque:
    """A torque that has passed a guard which allows nearly everything."""
    guard = TorqueGuard(guard_limits(1e9, 1e12))
    guard.enable()
    guard.check(TorqueRequest(0.0, 0.0, 0.0, 0.0), now_ns=0, evidence=FRESH)
    request = TorqueRequest(base_nm, prbs_nm, 0.0, 0.0)
    return guard.check(request, now_ns=1_000_000_000, evidence=FRESH)[0]


@dataclass(frozen=True, slots=True)
class Bench:
    channel: str
    rig: SimulatedRig
    link: CanLink
    m1: Inverter
    m2: Inverter

    def cycle(self, m1: GuardedTorque | None = None, m2: GuardedTorque | None = None) -> InverterFeedback:
        """One cycle; the feedback of m1, which must come."""
        for inverter, torque in ((self.m1, m1), (self.m2, m2)):
            if torque is not None:
                inverter.command(torque)
        feedback = self.m1.await_feedback(self.link.sync(), timeout_s=5.0)
        if feedback is None:
            raise AssertionError("no feedback of m1 in 5 s")
        return feedback

    def until_raised(self) -> None:
        """Cycle until m1 is found faulted."""

        def step() -> None:
            self.m1.await_feedback(self.link.sync(), timeout_s=0.02)
            self.m1.raise_if_faulted()

        repeat(step)

    @contextmanager
    def intruder(self) -> Iterator[can.BusABC]:
        """A third device on the bus, to send what the others must cope with."""
        with virtual_bus(self.channel) as bus:
            yield bus


@contextmanager
def bench(
    faults: InverterFaults = InverterFaults(),  # noqa: B008 - frozen
    *,
    settings: InverterSettings = M1,
    simulated: SimulatedInverter = SIMULATED_M1,
    plant: SimulatedPlant | None = None,
    seed: int = 1,
) -> Iterator[Bench]:
    channel = new_channel()
    pair = (replace(simulated, faults=faults), SIMULATED_M2)
    with (
        SimulatedRig(virtual_bus(channel), plant or RigidPlant(100.0, 0.5), pair, seed=seed) as rig,
        CanLink.open(f"virtual:{channel}") as link,
    ):
        yield Bench(channel, rig, link, Inverter(link, settings), Inverter(link, M2))


def repeat(step: Callable[[], None]) -> NoReturn:
    """Repeat a step until it raises; the timeout of the test ends it otherwise."""
    while True:
        step()


def frame(cob_id: int, data: bytes) -> can.Message:
    return can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)
