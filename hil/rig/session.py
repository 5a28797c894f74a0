"""One run from the idle rig to the idle rig: prepare, arm, drive, and always disarm.

::

    fit          beat, so that the PLC knows its host; set its generator off, see that the vehicle is fit
    configure    both inverters; the host keeps beating
    arm          both drives, each step confirmed
    wake up      zero torque until both have answered a SYNC; then the guard is enabled
    drive        the experiment, cycle by cycle; its measured part goes to the recording
    disarm       in `ArmedDrives`, on every way out; then the PLC's generator off, where it was used (`PlcPrbs`)
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from drivers.canopen.foreign_controllers import Strangers, foreign
from drivers.errors import ConfigMismatch, DriverError, ForeignController
from drivers.inverter.cob_ids import shared_cob_ids
from drivers.plc.types import PlcStatus
from hil.errors import RunAborted
from hil.rig.arming import ArmedDrives
from hil.rig.build import Devices
from hil.rig.cycle import Cycle
from hil.rig.drive import CycleProgress, Drive, Observer, Recorder, RunSummary
from hil.rig.excitation import PlcPrbs
from hil.rig.pacing import Pacer
from hil.rig.plan import Plan
from hil.rig.plc_loop import HostBeat
from hil.rig.plc_watch import PlcWatch, reasons_against
from hil.rig.stop import StopRequest
from hil.rig.timing import RunTiming


def run_plan(
    devices: Devices,
    plan: Plan,
    pacer: Pacer,
    recorder: Recorder,
    stop: StopRequest,
    progress: CycleProgress,
    timing: RunTiming | None = None,
    observers: Sequence[Observer] = (),
) -> RunSummary:
    """Run a plan on an opened rig."""
    before = _fit(devices, plan)
    with HostBeat(devices.plc_loop, devices.plc) as beat, _blaming_strangers(devices.link.pdos_to_disable):
        _configure(devices, stop)
        prbs = PlcPrbs(devices.plc_loop, devices.plc, plan.plc_prbs, pacer.poll_patience_s)
        with prbs, ArmedDrives(devices, stop):
            cycle = Cycle(devices, pacer.period_ns, pacer.answer_timeout_s, timing)
            watch = PlcWatch(devices.plc_loop, devices.plc, before, plan.needs, pacer.poll_patience_s)
            drive = Drive(plan, cycle, watch, prbs, pacer, recorder, stop, progress, observers)
            beat.hand_over()
            try:
                drive.wake_up()
                devices.guard.enable()
                return drive.run()
            except (DriverError, RunAborted) as error:
                _blame_the_host_first(error, drive.lateness)
                raise


@contextmanager
def _blaming_strangers(strangers: Strangers) -> Iterator[None]:
    """Where another controller was heard, what looks wrong with a device may be its doing."""
    try:
        yield
    except ForeignController:
        raise
    except (DriverError, RunAborted) as error:
        if strangers.heard is None:
            raise
        cause = foreign(strangers.heard)
        cause.args = (f"{cause} What this program met: {error}",)
        raise cause from error


def _blame_the_host_first(error: Exception, lateness: str) -> None:
    """Where this machine was late, whatever looks wrong with a device may be its own doing."""
    if lateness and "too busy" not in str(error):
        error.args = (
            f"This machine was too busy within the last second: {lateness}; close other programs before you look "
            f"at anything else. What ended the run then: {error}",
        )


def _fit(devices: Devices, plan: Plan) -> PlcStatus:
    """Have the PLC's own generator off, and the vehicle fit for the run."""
    devices.plc_loop.call(devices.plc.stop_prbs())
    status = devices.plc_loop.call(devices.plc.greet())
    if reasons := list(reasons_against(status, plan.needs)):
        raise RunAborted(f"PLC: {'; '.join(reasons)}. Nothing was armed; bring the vehicle into that state first.")
    return status


def _configure(devices: Devices, stop: StopRequest) -> None:
    for inverter in (devices.m1, devices.m2):
        inverter.wake()
    if shared := tuple(shared_cob_ids(devices.m1, devices.m2, devices.gateway_cob_ids)):
        raise ConfigMismatch(f"{'; '.join(map(str, shared))}. Give each COB-IDs of its own.")
    for inverter in (devices.m1, devices.m2):
        stop.raise_if_requested()
        inverter.configure()
