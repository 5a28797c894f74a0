"""The bus's health as the rig's process sees it: life signs of both nodes, the PLC, the cycle's timing."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from drivers.canopen import emcy
from drivers.canopen.can_link import CanLink
from drivers.canopen.emcy import EMCY_COB_ID
from drivers.canopen.heartbeat import HEARTBEAT_COB_ID, NmtState
from drivers.inverter.inverter import Inverter
from drivers.plc.types import PlcStatus
from hil.monitor.messages import Health, Kind, NodeHealth, Notice, PlcHealth, TimingHealth
from hil.rig.build import Devices
from hil.rig.histogram import Histogram
from hil.rig.timing import RunTiming

NS_PER_S = 1_000_000_000

_NMT_TITLES = {state.value: state.title for state in NmtState}

Tell = Callable[[Notice], None]


class NodeWatch:
    """Life signs of one node, taken where frames are received; what is wrong with a frame is the driver's to say.

    Parameters
    ----------
    link
        The bus.
    inverter
        Whose life signs they are.
    tell
        Called with every EMCY.
    """

    def __init__(self, link: CanLink, inverter: Inverter, tell: Tell) -> None:
        self._inverter = inverter
        self._tell = tell
        self._name = inverter.settings.name
        self._beat: tuple[int, int] | None = None  # time [ns], NMT state
        self._emergency: emcy.Emergency | None = None
        self._n_emergencies = 0
        node_id = inverter.settings.node_id
        link.subscribe(HEARTBEAT_COB_ID + node_id, self._on_heartbeat)
        link.subscribe(EMCY_COB_ID + node_id, self._on_emergency)

    def look(self, now_ns: int, trouble: str | None) -> NodeHealth:
        """Tell its health at a moment of the monotonic clock [ns]."""
        settings, latest = self._inverter.settings, self._inverter.latest
        return NodeHealth(
            node_id=settings.node_id,
            power=None if latest is None else latest.state.value,
            nmt=None if self._beat is None else _NMT_TITLES.get(self._beat[1], f"0x{self._beat[1]:02X}"),
            heartbeat_age_s=None if self._beat is None else (now_ns - self._beat[0]) / NS_PER_S,
            heartbeat_limit_s=settings.heartbeat_timeout_ms / 1000.0,
            tpdo_age_s=None if latest is None else (now_ns - latest.t_ns) / NS_PER_S,
            emergency=None if self._emergency is None else str(self._emergency),
            n_emergencies=self._n_emergencies,
            trouble=trouble,
        )

    def _on_heartbeat(self, data: bytes, t_ns: int) -> None:
        if len(data) == 1:
            self._beat = (t_ns, data[0] & 0x7F)

    def _on_emergency(self, data: bytes, t_ns: int) -> None:
        emergency = emcy.decode(data)
        if emergency.is_reset:
            self._emergency = None
            self._tell(Notice(t_ns, Kind.EMCY, f"{self._name}: reset"))
            return
        self._emergency = emergency
        self._n_emergencies += 1
        self._tell(Notice(t_ns, Kind.EMCY, f"{self._name}: {emergency}"))


class HealthWatch:
    """Both nodes of an opened rig; see `NodeWatch`."""

    def __init__(self, devices: Devices, tell: Tell) -> None:
        self._m1 = NodeWatch(devices.link, devices.m1, tell)
        self._m2 = NodeWatch(devices.link, devices.m2, tell)

    def look(self, plc: PlcHealth, timing: RunTiming, troubles: tuple[str | None, str | None] = (None, None)) -> Health:
        """Tell the health of everything now."""
        now_ns = time.monotonic_ns()
        return Health(
            m1=self._m1.look(now_ns, troubles[0]),
            m2=self._m2.look(now_ns, troubles[1]),
            plc=plc,
            timing=timing_health(timing),
        )


def plc_health(status: PlcStatus | None, trouble: str | None) -> PlcHealth:
    """Tell the PLC's, from its last status; the age is by the host's monotonic clock."""
    age_s = None if status is None else status.age_ns(time.monotonic_ns()) / NS_PER_S
    return PlcHealth(status, age_s, trouble)


def timing_health(timing: RunTiming) -> TimingHealth:
    """Take the figures of a timing record that continues."""
    lateness, reply = timing.lateness, timing.reply_age
    return TimingHealth(
        period_s=timing.period_ns / NS_PER_S,
        cycles=timing.cycles,
        missed=timing.missed,
        late=timing.late,
        unanswered=timing.unanswered,
        lateness_p50_s=_quantile_s(lateness, 0.5),
        lateness_p99_s=_quantile_s(lateness, 0.99),
        lateness_max_s=lateness.max_ns / NS_PER_S if lateness.total else math.nan,
        reply_p50_s=_quantile_s(reply, 0.5),
        reply_p99_s=_quantile_s(reply, 0.99),
        reply_max_s=reply.max_ns / NS_PER_S if reply.total else math.nan,
    )


def _quantile_s(histogram: Histogram, share: float) -> float:
    time_ns = histogram.quantile_ns(share)
    return math.nan if time_ns is None else time_ns / NS_PER_S
