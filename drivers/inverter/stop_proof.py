"""What stands between a dead host and torque, drive by drive, and the proof of it without commanding any.

==================== ==========================================================================================
heartbeat_consumer   0x1016: the drive watches the host's heartbeat: program, computer or cable gone
rpdo_deadline        0x14xx:05: it expects an RPDO that often: a host whose cycle hangs and whose heart beats
abort_connection     0x6007: what it does then; without it that is not known from the data sheet
sync_loss            0x1006: it may watch SYNC; what it makes of that is its maker's
drive_watchdog       the drive's own, as its maker names it
==================== ==========================================================================================

The first three are to be there or accepted by name in the rig file; the others are reported, for they may be the
reason. The event timer of an RPDO is its deadline monitoring (CiA 301, 7.5.2.35): it runs from the first RPDO received,
and a drive that misses the next says EMCY 0x8250.

For the proof the drive is configured as for a run and brought to READY TO SWITCH ON: its power stage is off, and no
command leads to torque. Then the host plays dead, once by its commands, once by its heartbeat. A drive that watches its
host says so by EMCY, and leaves READY TO SWITCH ON as its abort connection option code 0x6007 has it: the same reaction
that takes the torque away in a run. What it would do with a torque is not seen; that much is its maker's word.

A drive lacks some of this, and somebody has accepted that. Without a deadline of its RPDO it is left without commands
and without SYNC all the same: what it then does by itself is part of the evidence. Without a consumer of heartbeats
there is nothing to play dead to. Without 0x6007 it is to say that its host is gone; what it then does is written down.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from drivers.canopen.can_link import CanLink
from drivers.canopen.node_monitor import NodeMonitor
from drivers.canopen.sdo import object_name
from drivers.capability.plan import DrivePlan
from drivers.capability.table import EVENT_TIMER, Function
from drivers.errors import ConfigMismatch, DeviceFault
from drivers.inverter.check import Difference
from drivers.inverter.cia402 import FAULT_STATES, TORQUE_STATES, Command, PowerState
from drivers.inverter.dead_time import dead_cycles
from drivers.inverter.drive_settings import ABORT_CONNECTION, NO_ACTION, DriveSetting, chosen_code
from drivers.inverter.power_control import PowerControl
from drivers.inverter.settings import Acceptance, InverterSettings, acceptance_line

SYNC_PERIOD: Final = 0x1006
ERROR_BEHAVIOUR: Final = (0x1029, 1)

REACTIONS: Final[Mapping[int, str]] = {1: "fault", 2: "disable voltage", 3: "quick stop"}
"""Of the abort connection option code (CiA 402-2)."""

_BEHAVIOURS: Final[Mapping[int, str]] = {0: "NMT PRE-OPERATIONAL", 1: "no change of state", 2: "NMT STOPPED"}
"""Of the error behaviour for communication errors (CiA 301)."""

_WATCHDOG: Final = re.compile(
    r"watch ?dog|(comm|communication|bus|can|host|master)[\w ]*(loss|lost|time ?out|time-out|monitor)", re.IGNORECASE
)
"""Names that makers give to a watchdog of their own."""

_MANUFACTURER: Final = range(0x2000, 0x6000)

NEEDED: Final = ("heartbeat_consumer", "rpdo_deadline", "abort_connection")
"""What is to be there, or accepted."""

SOURCE = "proof"  # where the expectations come from, in the differences found

CONSUMER_HEARTBEAT = 0x1016

HEARD_PERIODS = 3
"""So many of the host's heartbeats come before they end: a consumer watches from the first it hears (CiA 301)."""

PATIENCE_S = 0.1
"""How much later than promised a drive may say that its host is gone [s]: neither end is a real-time system. With the
defaults that is 0.25 s without host or command."""

LONGEST_LOOK_S = 0.05  # a longer time between two looks is one in which this machine was held up [s]
CONNECTION_LOST = (0x8100, 0x8200)  # error classes of CiA 301 that say so: communication, protocol


@dataclass(frozen=True, slots=True)
class Protection:
    """One thing that takes the torque away without the host."""

    name: str  # its name in the rig file
    against: str  # what it notices, or does
    by: str = ""  # object and setting by which it is there
    accepted: Acceptance | None = None  # who accepted that it is missing
    proof: str = ""  # what a stop proof has seen of it

    @property
    def in_order(self) -> bool:
        """Whether it is there, or does not have to be."""
        return bool(self.by) or self.accepted is not None or self.name not in NEEDED

    def __str__(self) -> str:
        state = self.by or ("none" if self.accepted is None else f"none, {self.accepted}")
        return f"{self.name}: {state}{f'; {self.proof}' if self.proof else ''}"


def protections(plan: DrivePlan, settings: InverterSettings) -> tuple[Protection, ...]:
    """List what a drive has, by its data sheet and the rig file."""
    return tuple(_protections(plan, settings))


def require_protections(plan: DrivePlan, settings: InverterSettings) -> None:
    """See that nothing is missing that nobody has accepted."""
    missing = [each for each in protections(plan, settings) if not each.in_order]
    if missing:
        reasons = "; ".join(f"{each.name} ({each.against})" for each in missing)
        lines = "; ".join(acceptance_line(each.name) for each in missing)
        raise ConfigMismatch(
            f"{settings.where}: by its {plan.sheet.kind} the drive lacks what takes its torque away without the host: "
            f"{reasons}. Expected each to be there, or accepted in [inverters.{settings.name}] of the rig file by name "
            f"and with the reason: {lines}"
        )


def _protections(plan: DrivePlan, settings: InverterSettings) -> Iterator[Protection]:
    accepted = settings.accepted
    watched = plan.has(Function.HEARTBEAT_CONSUMER), plan.has(Function.RPDO_DEADLINE)
    yield Protection(
        "heartbeat_consumer",
        "host, computer or cable gone",
        f"{object_name(0x1016, 1)}, {settings.host_timeout_ms} ms" if watched[0] else "",
        accepted.get("heartbeat_consumer"),
    )
    parts = plan.abilities[Function.RPDO_DEADLINE].parts
    yield Protection(
        "rpdo_deadline",
        "cycle of the host hangs while its heart beats",
        f"{object_name(parts[0].index, EVENT_TIMER)}, {settings.rpdo_deadline_ms} ms" if parts else "",
        accepted.get("rpdo_deadline"),
    )
    yield Protection(
        "abort_connection",
        "what the drive does when it notices",
        _reaction(plan, settings) if any(watched) else "nothing is noticed, so nothing is to be done",
        accepted.get("abort_connection"),
    )
    yield Protection("sync_loss", "SYNC gone", _sync_period(plan))
    yield Protection("drive_watchdog", "whatever its maker has it watch", _own_watchdogs(plan))


def _reaction(plan: DrivePlan, settings: InverterSettings) -> str:
    if not plan.has(Function.ABORT_CONNECTION):
        return ""
    chosen = chosen_code(plan, settings, ABORT_CONNECTION)
    code = plan.sheet.value(ABORT_CONNECTION) if chosen is None else chosen[0]
    if code == NO_ACTION:
        return ""
    shown = "the drive's own" if code is None else f"{code} ({REACTIONS.get(code, 'the maker has it')})"
    behaviour = plan.sheet.value(*ERROR_BEHAVIOUR)
    more = (
        f", {object_name(*ERROR_BEHAVIOUR)} {_BEHAVIOURS[behaviour]}"
        if behaviour is not None and behaviour in _BEHAVIOURS
        else ""
    )
    return f"{object_name(ABORT_CONNECTION)} {shown}{more}"


def _sync_period(plan: DrivePlan) -> str:
    return "" if plan.sheet.entry(SYNC_PERIOD) is None else f"{object_name(SYNC_PERIOD)} is there: see the manual"


def _own_watchdogs(plan: DrivePlan) -> str:
    found = [
        f"0x{index:04X} {described.section.get('ParameterName')}"
        for index, described in plan.sheet.objects.items()
        if index in _MANUFACTURER and _WATCHDOG.search(described.section.get("ParameterName") or "")
    ]
    return f"{', '.join(found)}: see the manual" if found else ""


class StopProof:
    """The host of one drive, playing dead; before that it counts how long an answer takes (`dead_cycles`)."""

    def __init__(
        self,
        link: CanLink,
        settings: InverterSettings,
        power: PowerControl,
        monitor: NodeMonitor,
        configure: Callable[[], None],
        send: Callable[[Command], None],
        await_state: Callable[[int, float], PowerState | None],
    ) -> None:
        self._link = link
        self._settings = settings
        self._power = power
        self._monitor = monitor
        self._configure = configure
        self._send = send
        self._await_state = await_state
        self._reacts = True
        self._longest_look_s = LONGEST_LOOK_S
        self.seen: dict[str, str] = {}
        self.dead_cycles: int | None = None

    def run(self, given: tuple[DriveSetting, ...], period_s: float) -> Iterator[Difference]:
        """Play dead in both ways; the drive is disabled at the end."""
        self._refuse_if_driven()
        self._longest_look_s = max(LONGEST_LOOK_S, 2.0 * period_s)
        self._reacts = self._power.reacts_to_a_lost_host()
        timers = [setting for setting in given if setting.subindex == EVENT_TIMER and setting.watches_host]
        consumers = [setting for setting in given if setting.index == CONSUMER_HEARTBEAT]
        try:
            self._make_ready()
            self.dead_cycles = dead_cycles(lambda command: self._exchange(command, period_s))
            self._revive()
            if timers:
                yield from self._without_commands(timers[0], period_s)
            else:
                self._without_anything()
            self._revive()
            if consumers:
                yield from self._without_heartbeat(consumers[0])
                self._revive()
        finally:
            self._link.stop_heartbeat()
            self._power.disable_voltage()

    def _refuse_if_driven(self) -> None:
        state = self._power.state()
        if state in TORQUE_STATES:
            raise DeviceFault(
                f"{self._settings.where}: power state is {state.value}, expected a drive that is disabled: another "
                "program drives it, and this proof would take its torque away. End that program first."
            )

    def _without_commands(self, timer: DriveSetting, period_s: float) -> Iterator[Difference]:
        self._make_ready()
        self._send(Command.SHUTDOWN)
        self._link.sync()
        yield from self._noticed(
            "stop without commands", "rpdo_deadline", timer, timer.value, lambda: self._sync_and_wait(period_s)
        )

    def _without_anything(self) -> None:
        """Let a drive without a deadline be without commands and SYNC, and write down what it does by itself."""
        self._make_ready()
        self._send(Command.SHUTDOWN)
        self._link.sync()
        self._watch(self._settings.rpdo_deadline_ms, _wait)
        state = self._power.state()
        if self._monitor.emergency is not None or state is not PowerState.READY_TO_SWITCH_ON:
            self.seen["drive_watchdog"] = f"proven without commands and SYNC: {self._answer(state)}"
        else:
            within_ms = self._settings.rpdo_deadline_ms
            self.seen["rpdo_deadline"] = f"without commands and SYNC nothing happened within {within_ms} ms"

    def _without_heartbeat(self, consumer: DriveSetting) -> Iterator[Difference]:
        self._make_ready()
        time.sleep(HEARD_PERIODS * self._settings.host_heartbeat_s)
        self._link.stop_heartbeat()
        yield from self._noticed(
            "stop without heartbeat", "heartbeat_consumer", consumer, self._settings.host_timeout_ms, _wait
        )

    def _revive(self) -> None:
        """Come back to life; a fault that playing dead has made, 0x6007 being 1, is reset."""
        self._link.produce_heartbeat(self._settings.host_heartbeat_s, self._settings.host_node_id)
        if self._power.state() in FAULT_STATES:
            self._power.reset_fault()
        else:
            self._power.disable_voltage()  # what comes next takes the connection away, which it need not notice now

    def _make_ready(self) -> None:
        self._configure()
        self._power.make_ready()
        self._monitor.forget_emergency()

    def _noticed(
        self, what: str, name: str, entry: DriveSetting, within_ms: int, pause: Callable[[], None]
    ) -> Iterator[Difference]:
        after_s = self._watch(within_ms, pause)
        state = self._power.state()
        left = state is not PowerState.READY_TO_SWITCH_ON
        if self._complained() and (left or not self._reacts):
            self.seen[name] = f"proven after {after_s:.2f} s: {self._answer(state)}"
            self.seen.setdefault("abort_connection", f"seen without a host: power state {state.value}")
            return
        expected = f"an EMCY 0x81xx or 0x82xx within {within_ms} ms"
        yield Difference(
            self._settings.where,
            what,
            f"{expected}, and READY TO SWITCH ON left" if self._reacts else expected,
            f"{self._answer(state)}; the entry that failed is {entry}",
            SOURCE,
        )

    def _watch(self, within_ms: int, pause: Callable[[], None]) -> float:
        """Wait until the drive says that its host is gone, or the time is over; give how long that took [s].

        Time in which this machine itself was held up does not count against the drive.
        """
        began_s = looked_s = time.monotonic()
        awake_s = 0.0
        while not self._complained() and awake_s < within_ms / 1000.0 + PATIENCE_S:
            pause()
            awake_s += min(time.monotonic() - looked_s, self._longest_look_s)
            looked_s = time.monotonic()
        return time.monotonic() - began_s

    def _answer(self, state: PowerState) -> str:
        return f"{self._monitor.emergency or 'no EMCY'}, power state {state.value}"

    def _complained(self) -> bool:
        emergency = self._monitor.emergency
        return emergency is not None and emergency.code & 0xFF00 in CONNECTION_LOST

    def _exchange(self, command: Command, period_s: float) -> PowerState | None:
        """Spend one cycle as a run does."""
        began_s = time.monotonic()
        self._send(command)
        state = self._await_state(self._link.sync(), period_s)
        time.sleep(max(0.0, began_s + period_s - time.monotonic()))
        return state

    def _sync_and_wait(self, period_s: float) -> None:
        self._link.sync()
        time.sleep(period_s)


def _wait() -> None:
    time.sleep(0.01)
