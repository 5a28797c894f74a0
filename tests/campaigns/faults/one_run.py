"""One run in simulated time with one fault at one moment, and what is wrong with how it ended."""

from __future__ import annotations

import errno
import re
import time
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from io import FileIO
from pathlib import Path
from unittest import mock

from drivers.canopen.can_link import CanLink
from drivers.errors import BusDown
from hil.config.rig_file import Rig
from hil.errors import RecordingError
from hil.recording import RecordingWriter, read_table, writer
from hil.recording.writer import WritingThread
from hil.rig.build import open_devices
from hil.rig.experiments.base import Phase
from hil.rig.pacing import FreePacer, Tick, period_ns
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.simulator.addresses import Address, with_addresses
from hil.simulator.fault_table import rig_faults
from hil.simulator.rig_server import RigServer
from tests.campaigns.faults.kinds import UNTOUCHED, Kind
from tests.campaigns.faults.rig import WatchedPlant
from tests.rig.observer import DISARMED, power_state

PATIENCE_S = 0.05
"""Of the wall clock, for an answer of a simulated drive that may not come."""

BUSY_S = 20.0
"""Of the wall clock, for whatever is well: the machine may be busy."""

COUNT_NM = 0.6 + 1e-9
"""One per mille of rated torque: torques on the bus are rounded to it."""

STALL_CYCLES = 200

NOTICED_S = 0.3
"""Within this a torque that is not the one asked for has to be over."""


@dataclass
class Outcome:
    """How a run ended."""

    said: str = ""
    zero_s: float = 0.0
    steps: int = 0
    problems: list[str] = field(default_factory=list)


class _FullDisk:
    """A file whose disk is full from a moment on."""

    def __init__(self, file: FileIO, meets: _Moment) -> None:
        self._file = file
        self._meets = meets

    def write(self, data: bytes) -> int | None:
        if self._meets.due:
            self._meets.meet()
            raise OSError(errno.ENOSPC, "No space left on device")
        return self._file.write(data)

    def close(self) -> None:
        self._file.close()


class _Moment:
    """Whether a SYNC has come."""

    def __init__(self, plant: WatchedPlant, step: int) -> None:
        self._plant = plant
        self._step = self.met = step

    def meet(self) -> None:
        """Take note of when it showed; before that nobody could know."""
        if self.met == self._step:
            self.met = len(self._plant.torques_nm)

    @property
    def due(self) -> bool:
        return len(self._plant.torques_nm) >= self._step


class _StallingPacer(FreePacer):
    """Simulated time in which the host is once late by two seconds."""

    def __init__(self, period_ns: int, moment: _Moment) -> None:
        super().__init__(period_ns, PATIENCE_S)
        self._moment = moment
        self._stalled = 0

    def next(self) -> Tick:
        tick = super().next()
        late_ns = 0
        if self._moment.due and not self._stalled:
            late_ns, self._stalled = STALL_CYCLES * self.period_ns, STALL_CYCLES
            return Tick(tick.cycle, tick.due_ns, late_ns)
        return Tick(tick.cycle + self._stalled, tick.due_ns + self._stalled * self.period_ns, 0)


def run_with(rig: Rig, experiment: str, kind: Kind, at_s: float, folder: Path, steps: int = 0) -> Outcome:
    """Run an experiment with a fault."""
    outcome = Outcome()
    plant, path = WatchedPlant(rig.inverters.m1.rated_torque_nm), folder / f"{uuid.uuid4()}.csv"
    faults = rig_faults([kind.spec.replace("@S", f"@{at_s}")] if kind.spec else [], rig.period_s)
    server = RigServer(plant, rig, f"virtual:{uuid.uuid4()}", Address("127.0.0.1", 0), faults)
    step = round(at_s / rig.period_s)
    moment = _Moment(plant, step)
    with ExitStack() as stack:
        stack.enter_context(server)
        plant.listen(stack.enter_context(CanLink.open(server.bus_url)))
        at = with_addresses(rig, server.bus_url, str(server.modbus))
        recorder = RecordingWriter(path)
        try:
            _drive(at, experiment, kind, recorder, moment, server, stack)
        except KeyboardInterrupt:
            outcome.said = "KeyboardInterrupt"
        except Exception as error:  # noqa: BLE001 - whatever it is, it is looked at
            outcome.said = _whole_story(error)
        outcome.steps = len(plant.torques_nm)
        outcome.zero_s = _zero_s(plant, server, moment.met, rig.period_s, outcome)
        if kind.needs_torque or kind.exceeds:
            outcome.zero_s = _wrong_s(plant, rig, outcome)
        _judge_torque(kind, rig, plant, outcome)
        _judge_drives(kind, rig, server, outcome)
    _judge_words(kind, experiment, step, steps, outcome)
    _judge_recording(recorder, path, outcome)
    return outcome


def _drive(
    rig: Rig,
    experiment: str,
    kind: Kind,
    recorder: RecordingWriter,
    moment: _Moment,
    server: RigServer,
    stack: ExitStack,
) -> None:
    stop = StopRequest()
    pacer = (
        _StallingPacer(period_ns(rig.period_s), moment)
        if kind.host == "stall"
        else FreePacer(period_ns(rig.period_s), PATIENCE_S)
    )
    act = _action(kind, stop, server, stack)
    met = False

    def progress(phase: Phase, time_s: float) -> None:
        nonlocal met
        if moment.due and not met:
            met = True
            act()

    patience_s = 0.0 if kind.spec.startswith("plc.") else BUSY_S
    with _disk(kind, moment), recorder, open_devices(rig, patience_s) as devices:
        run_plan(devices, plan_run(rig, experiment), pacer, recorder, stop, progress)


def _action(kind: Kind, stop: StopRequest, server: RigServer, stack: ExitStack):  # type: ignore[no-untyped-def]
    if kind.host == "stop":
        return stop.request
    if ":" in kind.host:
        cob_id, _, data = kind.host.partition(":")
        stranger = stack.enter_context(CanLink.open(server.bus_url))
        return lambda: stranger.send(int(cob_id, 16), bytes.fromhex(data))
    return lambda: None


@contextmanager
def _disk(kind: Kind, moment: _Moment) -> Iterator[None]:
    if kind.host != "disk":
        yield
        return
    full = lambda file, capacity: WritingThread(_FullDisk(file, moment), capacity)  # noqa: E731
    with mock.patch.object(writer, "WritingThread", full):
        yield


def _whole_story(error: BaseException) -> str:
    said = [str(error) or type(error).__name__, *getattr(error, "__notes__", ())]
    if error.__cause__ is not None:
        said.append(_whole_story(error.__cause__))
    return " | ".join(said)


def _zero_s(plant: WatchedPlant, server: RigServer, step: int, period_s: float, outcome: Outcome) -> float:
    """Time from the fault to zero: of simulated time, and of the wall clock where SYNC has ended before."""
    last = max((k + 1 for k, torques in enumerate(plant.torques_nm) if any(torques)), default=0)
    simulated_s = max(0, last - step) * period_s
    began_s = time.monotonic()
    while server.torque_nm != (0.0, 0.0):
        if time.monotonic() - began_s > 10.0:
            outcome.problems.append(f"torque is left at {server.torque_nm}")
            break
        time.sleep(0.005)
    return simulated_s + (time.monotonic() - began_s)


def _wrong_s(plant: WatchedPlant, rig: Rig, outcome: Outcome) -> float:
    """Longest time for which a torque was further from the one asked for than the guard allows [s]."""
    error = rig.guard_limits.error
    longest = length = 0
    for given_nm, asked_nm in zip(plant.torques_nm, plant.asked_nm, strict=True):
        off_nm = [abs(given - asked) for given, asked in zip(given_nm, asked_nm, strict=True)]
        length = length + 1 if off_nm[0] > error.m1_nm + COUNT_NM or off_nm[1] > error.m2_nm + COUNT_NM else 0
        longest = max(longest, length)
    if longest * rig.period_s > NOTICED_S:
        outcome.problems.append(f"torque was wrong for {longest * rig.period_s:.2f} s")
    return longest * rig.period_s


def _judge_torque(kind: Kind, rig: Rig, plant: WatchedPlant, outcome: Outcome) -> None:
    limits = (rig.inverters.m1.torque_limit_nm, rig.inverters.m2.torque_limit_nm)
    for torques_nm in (*plant.asked_nm, *(() if kind.exceeds else plant.torques_nm)):
        beyond = any(abs(torque_nm) > limit + COUNT_NM for torque_nm, limit in zip(torques_nm, limits, strict=True))
        if beyond or abs(sum(torques_nm)) > rig.guard.sum_limit_nm + 2 * COUNT_NM:
            outcome.problems.append(f"torques were {torques_nm} Nm")
            return


def _judge_drives(kind: Kind, rig: Rig, server: RigServer, outcome: Outcome) -> None:
    for number, table in ((1, rig.inverters.m1), (2, rig.inverters.m2)):
        if kind.silent in (number, 3):
            continue
        state = None
        with suppress(BusDown, AssertionError):
            state = power_state(server.bus_url, table.node_id)
        allowed = {each.value for each in DISARMED} | {"fault", "fault reaction active"}
        if state is None or state.value not in allowed:
            outcome.problems.append(f"drive m{number} is in {None if state is None else state.value}")


def _judge_words(kind: Kind, experiment: str, step: int, steps: int, outcome: Outcome) -> None:
    if outcome.said:
        if kind is UNTOUCHED or not re.search(kind.cause, outcome.said, re.DOTALL):
            outcome.problems.append(f"said {outcome.said[:300]!r}, expected {kind.cause!r}")
        return
    in_time = step < steps - 40  # later there is nothing left to notice it by
    idle = kind.needs_torque and experiment in ("rest", "pulses", "cruise")
    if in_time and not kind.may_pass and not idle:
        outcome.problems.append(f"went to its end with the fault at SYNC {step} of {steps}")


def _judge_recording(recorder: RecordingWriter, path: Path, outcome: Outcome) -> None:
    kept = recorder.written_file
    try:
        rows = 0 if kept is None else read_table(kept).n_rows
    except RecordingError as error:
        outcome.problems.append(f"recording: {error}")
        return
    if rows != recorder.n_samples:
        outcome.problems.append(f"recording has {rows} rows, {recorder.n_samples} were written")
    for left in path.parent.glob(f"{path.stem}*"):
        left.unlink()
