"""A source that says what a test has it say, and remembers what it was sent."""

import asyncio
import math
from collections.abc import Sequence
from types import TracebackType
from typing import Self

from textual.pilot import Pilot

from hil.monitor.app import MonitorApp
from hil.monitor.messages import Health, NodeHealth, Order, PlcHealth, Ready, Report, TimingHealth
from hil.sample import Sample, SampleFlag

PERIOD_S = 0.01


class FakeSource:
    """Gives ``coming`` once; orders are in ``sent``."""

    def __init__(self, can_drive: bool = True, coming: Sequence[Report] = (Ready(),)) -> None:
        self.can_drive = can_drive
        self.coming = list(coming)
        self.sent: list[Order] = []

    def poll(self) -> Sequence[Report]:
        reports, self.coming = self.coming, []
        return reports

    def send(self, order: Order) -> None:
        self.sent.append(order)

    def await_end(self) -> None:
        """Nothing drives."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.coming = []


def sample(
    cycle: int,
    torque_nm: float = 0.0,
    speed_rad_s: float = 0.0,
    prbs_nm: float = 0.0,
    flags: SampleFlag = SampleFlag.GOOD,
) -> Sample:
    """One cycle of the fake rig; both inverters give half."""
    return Sample(
        cycle=cycle,
        t_ns=round(cycle * PERIOD_S * 1e9),
        time_s=cycle * PERIOD_S,
        torque_ref_m1_nm=torque_nm / 2.0,
        torque_ref_m2_nm=torque_nm / 2.0,
        prbs_nm=prbs_nm,
        torque_m1_nm=torque_nm / 2.0,
        torque_m2_nm=torque_nm / 2.0,
        speed_rad_s=speed_rad_s,
        age_ns=0,
        flags=flags,
    )


def node(**changes: object) -> NodeHealth:
    """A healthy inverter, with changes."""
    healthy: dict[str, object] = {
        "node_id": 1,
        "power": "switch on disabled",
        "nmt": "OPERATIONAL",
        "heartbeat_age_s": 0.05,
        "heartbeat_limit_s": 0.5,
        "tpdo_age_s": 0.001,
        "emergency": None,
        "n_emergencies": 0,
        "trouble": None,
    }
    return NodeHealth(**{**healthy, **changes})  # type: ignore[arg-type]


def health(m1: NodeHealth | None = None, plc: PlcHealth | None = None) -> Health:
    """A healthy rig, with another first inverter or PLC."""
    nan = math.nan
    timing = TimingHealth(PERIOD_S, 0, 0, 0, 0, (nan, nan, nan), (nan, nan, nan))
    return Health(m1 or node(), node(node_id=2), plc or PlcHealth(None, None, None), timing)


async def settled(pilot: Pilot[None]) -> None:
    """Let the view take what has come and draw it now, not at its next picture."""
    assert isinstance(pilot.app, MonitorApp)
    pilot.app._tick()
    await pilot.pause()


async def ended(app: MonitorApp) -> None:
    """Let the view take what has come, and wait until it has ended."""
    app._tick()
    while app.is_running:
        await asyncio.sleep(0.01)
