"""What excites in a run: base torque and PRBS shared out to the two inverters, and the PLC's own PRBS generator.

The generator is on for the measured part and no longer, or off from end to end::

    planned      the amplitude passes the torque guard's rules before anything is connected
    a run begins the generator is off, confirmed
    MEASURE      settings written, read back, enabled: by the PLC's loop, while the torque cycle continues
    after it     off, in the same way
    every exit   off once more, confirmed, when the drives are at zero torque and disarmed

What the PLC adds, the host neither sends nor sees sample by sample: the guard of such a run keeps its amplitude
free, under the limits of each inverter and of the sum (`hil.config.rig_file.Rig.guard_limits`).
"""

from __future__ import annotations

import math
from concurrent.futures import Future
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from drivers.errors import BusDown, DriverError, WrongTorque
from drivers.inverter.supervision import NO_PART, PlcPart
from drivers.plc.plc import GENERATOR_OFF, Plc
from drivers.plc.types import PlcStatus, PrbsSettings
from drivers.torque_guard import Evidence, GuardedTorque, GuardLimits, TorqueGuard, TorqueRequest
from hil.errors import RunAborted
from hil.rig.experiments.base import Phase
from hil.rig.pacing import NS_PER_S, Tick
from hil.rig.plc_loop import PlcLoop

NO_TORQUE = TorqueRequest(0.0, 0.0, 0.0, 0.0)
"""What is asked for while nothing is driven."""


SETTLED_S = 0.05
"""After the PLC has confirmed a change, the drives have the torque that it makes by then [s]."""


@dataclass(frozen=True, slots=True)
class Split:
    """The part of a total torque that inverter m1 gives, 0 to 1; m2 gives the rest.

    Both act on one shaft, so that any split makes the same total; which inverter carries the PRBS is what a
    mismatch of the two is found by.
    """

    base_m1: float  # of the base torque: share_m1 of the experiment
    prbs_m1: float  # of the PRBS and of a damper's torque: target of [prbs]

    def request(self, base_nm: float, prbs_nm: float) -> TorqueRequest:
        """Request for a total base torque [Nm] and a total PRBS [Nm]."""
        return TorqueRequest(
            base_m1_nm=self.base_m1 * base_nm,
            prbs_m1_nm=self.prbs_m1 * prbs_nm,
            base_m2_nm=(1.0 - self.base_m1) * base_nm,
            prbs_m2_nm=(1.0 - self.prbs_m1) * prbs_nm,
        )

    @property
    def largest_base_share(self) -> float:
        """Base share of the inverter that gives more: its limits are met first."""
        return max(self.base_m1, 1.0 - self.base_m1)


@dataclass(frozen=True, slots=True)
class PlcPrbsOrder:
    """What the PLC's generator is sent: torques as the guard let them through, PLC cycles per level, first state."""

    m1: GuardedTorque  # `prbs_nm` of it is the amplitude at inverter m1 [Nm]
    m2: GuardedTorque  # the same at inverter m2
    clock_divider: int  # PLC cycles each level is held
    seed: int  # first state of the register, 1 to 1023


def guarded_prbs(limits: GuardLimits, split: Split, amplitude_nm: float) -> tuple[GuardedTorque, GuardedTorque]:
    """Have the torque guard's rules judge a PRBS; they hold either way, so that one of its two levels will do."""
    guard = TorqueGuard(limits)
    guard.enable()
    return guard.check(split.request(0.0, amplitude_nm), now_ns=0, evidence=Evidence(0, 0, 0.0))


class PlcPrbs:
    """The generator in one run; a context manager that leaves it off."""

    def __init__(self, loop: PlcLoop, plc: Plc, order: PlcPrbsOrder | None, patience_s: float) -> None:
        self._loop = loop
        self._plc = plc
        self._order = order
        self._patience_s = patience_s
        self._wanted = False
        self._change: Future[PrbsSettings] | None = None
        self._holds = GENERATOR_OFF
        self._since_ns: int | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        others = self._set_by_others() if isinstance(error, WrongTorque) else None
        if self._order is not None:
            self._switch_off(error)
        if others is not None:
            raise RunAborted(f"{others} What ended the run: {error}") from error

    def _set_by_others(self) -> str | None:
        """Ask, with the drives disarmed, whether a torque nobody commanded is the generator's."""
        try:
            status = self._loop.call(self._plc.read_status())
        except DriverError:  # it can't be asked: what ended the run stands
            return None
        return self._wrong_setting(status)

    def _switch_off(self, error: BaseException | None) -> None:
        try:
            self._loop.call(_switched_off(self._plc))
        except DriverError as failure:
            cause = "" if error is None else f" What ended the run: {error or type(error).__name__}"
            raise RunAborted(
                f"PLC: expected its own PRBS generator confirmed off, got: {failure} Switch it off at the PLC before "
                f"the drives are armed again.{cause}"
            ) from error

    def follow(self, tick: Tick, phase: Phase, status: PlcStatus) -> None:
        """Switch it with the phase of the experiment, and see that it is as it should be."""
        order = self._order if phase is Phase.MEASURE else None
        if self._change is None and (order is not None) is not self._wanted:
            self._wanted = order is not None
            self._change = self._loop.start(_ordered(self._plc, order))
        self._take_change(tick)
        if self._change is None and (self._since_ns is None or status.t_ns > self._since_ns):
            self._judge(status)

    def part(self, tick: Tick) -> PlcPart:
        """Give what the PLC may add in this cycle: nothing while it is confirmed off, anything while that changes."""
        if self._order is None:
            return NO_PART
        parts_nm = abs(self._order.m1.prbs_nm), abs(self._order.m2.prbs_nm)
        settled = self._since_ns is None or tick.now_ns - self._since_ns > SETTLED_S * NS_PER_S
        if self._change is not None or not settled:
            return PlcPart(*parts_nm, is_on=False)
        return PlcPart(*parts_nm, is_on=True) if self._holds.enabled else NO_PART

    def known_nm(self, news: PlcStatus | None) -> float:
        """Give what the PLC reports to put out, where it reported since the last cycle; NaN otherwise [Nm]."""
        return math.nan if news is None else news.prbs_torque_nm

    def _take_change(self, tick: Tick) -> None:
        if self._change is None:
            return
        try:
            self._holds = self._change.result(self._patience_s)
        except DriverError as error:
            raise RunAborted(f"PLC: expected its PRBS generator to do as ordered, got: {error}") from error
        except TimeoutError:
            return  # under way; the PLC's silence is the watch's to see
        self._change, self._since_ns = None, tick.now_ns

    def _judge(self, status: PlcStatus) -> None:
        if wrong := self._wrong_setting(status):
            raise RunAborted(wrong)

    def _wrong_setting(self, status: PlcStatus) -> str | None:
        as_ordered = status.prbs == self._holds if self._holds.enabled else not status.prbs.enabled
        if as_ordered:
            return None
        return (
            f"PLC: its own PRBS generator is set to {_shown(status.prbs)}, expected {_shown(self._holds)}. The run "
            "was ended at zero torque; look for another host that writes there."
        )


async def _ordered(plc: Plc, order: PlcPrbsOrder | None) -> PrbsSettings:
    if order is None:
        return await plc.stop_prbs()
    return await plc.start_prbs(order.m1, order.m2, order.clock_divider, order.seed)


async def _switched_off(plc: Plc) -> None:
    """Switch it off, over a new connection where the old one is lost."""
    try:
        await plc.stop_prbs()
    except BusDown:
        await plc.connect()
        await plc.stop_prbs()


def _shown(prbs: PrbsSettings) -> str:
    if not prbs.enabled:
        return "off"
    return f"on, {prbs.amplitude_nm:g} Nm, divider {prbs.clock_divider}, seed {prbs.seed}, source {prbs.source.value}"
