"""``python -m tests.campaigns.faults.middle``: a man in the middle of the bus, judged by the simulated shaft.

Between the host and the simulated rig frames are changed, lost, repeated and invented: kind, drive, moment, pattern
(once, burst, periodic, for ever) and size are drawn. How a run ended is judged by what turned the shaft, which no code
of the product has a part in: the torques the plant was driven with against those the host sent before they were
changed, and the plant's own speed. A failure is a run that continues after the torque was wrong by more than stated, or
a shaft that got faster than the experiment has it, or a drive that is not disarmed at the end.
"""

import math
import re
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, nullcontext
from functools import cache, partial
from itertools import combinations
from pathlib import Path
from typing import Any
from unittest import mock

import can
import numpy as np

from drivers.canopen.can_link import SYNC_COB_ID, CanLink
from drivers.inverter.drive_supervision import NO_TORQUE_S
from drivers.inverter.observer import BLOCK_S
from drivers.inverter.supervision import MOST_HELD_RAD_S, PRBS_S
from drivers.inverter.vehicle import ROLLING_RAD_S2
from drivers.plc.plc import Plc
from drivers.plc.register import Register, RegisterKind
from drivers.plc.register_map import RegisterMap
from hil.config.rig_file import Rig
from hil.recording import RecordingWriter, read_table
from hil.rig import build
from hil.rig.build import Devices, open_devices
from hil.rig.experiments.base import Phase
from hil.rig.pacing import FreePacer, period_ns
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.simulator.addresses import Address, with_addresses
from hil.simulator.rig_server import RigServer
from tests.campaigns.faults.middle_kinds import (
    ADDED,
    COMMAND,
    KINDS,
    LASTING,
    PATTERNS,
    RPDO,
    TO_DRIVE,
    TO_HOST,
    TO_HOST_OF_BOTH,
    TPDO,
    WITH_SYNC,
    Fault,
    rig_of,
)
from tests.campaigns.faults.one_run import COUNT_NM, PATIENCE_S, Outcome
from tests.campaigns.faults.rig import WatchedPlant, campaign_rig
from tests.campaigns.faults.runs import asked_for, tried
from tests.rig.observer import DISARMED, power_state

EXPERIMENTS = ("cruise", "reversal", "tip", "pulses")

LATE_CYCLES = 2
"""From the cycle that is too much to zero: the answer to the next SYNC shows it, and disarming takes one."""

PLAIN = ("PLC's", "slow slope")
"""Beginnings of kinds that are tried on rigs of their own: without what follows nothing goes wrong."""

SPEED_SLACK_RAD_S = 3.0

DEAD_READINGS = ("both speeds zero", "both speeds stuck")
"""What a vehicle does that friction holds. How fast one without any gets by then is no measure: it is known by what no
friction would hold, `ROLLING_RAD_S2` of a full vehicle, and how far that goes, `MOST_HELD_RAD_S`."""

FULL = 1.5  # times the inertia: the rig file's `inertia_full_kg_m2`
INERTIA_KG_M2 = 100.0


NAMED = {"PLC registers exchanged": "PLC", "two hosts at once": "somebody else|[Aa]nother host"}
"""What a message has to name, where that is no drive."""


class Man:
    """Stands between the host's link and its bus."""

    def __init__(self, fault: Fault, rated_nm: float) -> None:
        self._fault = fault
        self.kind = fault.kind
        self._scale_nm = rated_nm / 1000.0
        self._sent = [(0.0, 0.0), (0.0, 0.0)]
        self._ramp_nm = [0.0, 0.0]
        self.step_nm = math.inf
        self.cycle = 0
        self.fault_cycle = fault.at
        self.asked_nm: list[tuple[float, float]] = []
        self.on_fault: Callable[[], None] = lambda: None
        self.added_nm: Callable[[], tuple[float, float]] = lambda: (0.0, 0.0)

    def stand_between(self, devices: Devices) -> None:
        link = devices.link
        send, take = link.network._send, link._take
        self._take = take

        def out(message: can.Message) -> None:
            for each in self._out(message):
                send(each)

        def into(message: can.Message) -> None:
            for each in self._into(message):
                take(each)

        link.network._send = out
        link._bus.receive_by(into)  # type: ignore[attr-defined]

    def _out(self, message: can.Message) -> Iterator[can.Message]:
        fault, cob_id, data = self._fault, message.arbitration_id, bytes(message.data)
        if cob_id in (RPDO + 1, RPDO + 2):
            _, target, offset = COMMAND.unpack(data[:6])
            self._sent[cob_id - RPDO - 1] = target * self._scale_nm, offset * self._scale_nm
        if cob_id == SYNC_COB_ID:
            self.cycle += 1
            added = self.added_nm()
            self.asked_nm.append((self._sloped(0) + added[0], self._sloped(1) + added[1]))
            if fault.acts(self.cycle):
                self.on_fault()
                for base, extra in WITH_SYNC.get(fault.kind, ()):
                    self._take(_frame(base + fault.drive, extra))
        if not fault.acts(self.cycle):
            yield message
        elif fault.kind == "node ids exchanged" and cob_id in (RPDO + 1, RPDO + 2):
            yield _frame(2 * RPDO + 3 - cob_id, data)
        elif cob_id == RPDO + fault.drive and fault.kind in TO_DRIVE:
            yield from (_frame(cob_id, each) for each in TO_DRIVE[fault.kind](fault, data))
        else:
            yield message

    def _sloped(self, drive: int) -> float:
        """What a drive must give for what it was last sent: its slope holds the target torque [Nm]."""
        target_nm, offset_nm = self._sent[drive]
        step_nm = target_nm - self._ramp_nm[drive]
        self._ramp_nm[drive] += min(max(step_nm, -self.step_nm), self.step_nm)
        return self._ramp_nm[drive] + offset_nm

    def _into(self, message: can.Message) -> Iterator[can.Message]:
        fault, cob_id, data = self._fault, message.arbitration_id, bytes(message.data)
        if not fault.acts(self.cycle):
            yield message
        elif fault.kind == "node ids exchanged" and cob_id in (TPDO + 1, TPDO + 2):
            yield _frame(2 * TPDO + 3 - cob_id, data)
        elif cob_id in (TPDO + 1, TPDO + 2) and fault.kind in TO_HOST_OF_BOTH:
            changed = TO_HOST_OF_BOTH[fault.kind](fault, cob_id - TPDO, self.cycle, data)
            yield from (_frame(cob_id, each) for each in changed)
        elif cob_id == TPDO + fault.drive and fault.kind in TO_HOST:
            yield from (_frame(cob_id, each) for each in TO_HOST[fault.kind](fault, data))
        else:
            yield message


def _frame(cob_id: int, data: bytes) -> can.Message:
    return can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)


class Shaft(WatchedPlant):
    """The plant, with its own speed kept [rad/s]."""

    def __init__(self, rated_nm: float) -> None:
        super().__init__(rated_nm, INERTIA_KG_M2)
        self.speeds_rad_s: list[float] = []

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        super().advance(torque_nm, duration_s)
        self.speeds_rad_s.append(self.speed_rad_s)


def drawn(rng: np.random.Generator, kind: str, steps: int) -> Fault:
    period = int(rng.integers(2, 60))
    return Fault(
        kind,
        drive=int(rng.integers(1, 3)),
        at=int(rng.integers(5, max(6, steps - 5))),
        pattern=str(rng.choice(PATTERNS)),
        on=int(rng.integers(1, period + 1)),
        period=period,
        size=float(rng.random()),
    )


def run_with(rig: Rig, experiment: str, fault: Fault, folder: Path, fastest_rad_s: float) -> tuple[Outcome, Shaft]:
    """Carry out one run and judge it."""
    rig = rig_of(fault.kind, rig)
    outcome, shaft = Outcome(), Shaft(rig.inverters.m1.rated_torque_nm)
    man = Man(fault, rig.inverters.m1.rated_torque_nm)
    man.step_nm = (rig.inverters.m1.torque_slope_nm_per_s or math.inf) * rig.period_s
    path = folder / f"{uuid.uuid4()}.csv"
    server = RigServer(shaft, rig, f"virtual:{uuid.uuid4()}", Address("127.0.0.1", 0))
    patient = mock.patch.object(build, "Plc", partial(_plc, fault))
    with ExitStack() as stack:
        stack.enter_context(server)
        at = with_addresses(rig, server.bus_url, str(server.modbus))
        man.added_nm = _with_added(fault, server, man)
        recorder = RecordingWriter(path)
        man.on_fault = _also(fault, server, stack)
        stack.enter_context(patient)
        if fault.kind == "two hosts at once":
            _start_together(outcome, partial(_driven, at, experiment, recorder), partial(_driven, at, experiment, None))
        else:
            outcome.said = _driven(at, experiment, recorder, man)
        outcome.steps = len(shaft.torques_nm)
        _judge_shaft(rig, man, shaft, fastest_rad_s, outcome)
        _judge_end(rig, server, fault, outcome)
    if recorder.written_file is not None and read_table(recorder.written_file).n_rows != recorder.n_samples:
        outcome.problems.append("the recording lacks rows")
    for left in folder.glob(f"{path.stem}*"):
        left.unlink()
    return outcome, shaft


def _with_added(fault: Fault, server: RigServer, man: Man) -> Callable[[], tuple[float, float]]:
    """Have one drive make something else of what the PLC adds; give what the PLC means to add [Nm]."""
    added_nm = server._plc_torque_nm

    def given() -> tuple[float, float]:
        both = list(added_nm())
        if fault.kind in ADDED and fault.acts(man.cycle):
            both[fault.drive - 1] *= ADDED[fault.kind]
        return both[0], both[1]

    server._slaves.add_torque_from(given)
    return added_nm


def _driven(at: Rig, experiment: str, recorder: RecordingWriter | None, man: Man | None = None) -> str:
    """Drive as ``hil run`` does; give what it says where the run ends early."""
    try:
        with recorder or nullcontext(), open_devices(at) as devices:
            if man is not None:
                man.stand_between(devices)
            pacer = FreePacer(period_ns(at.period_s), PATIENCE_S)
            run_plan(devices, plan_run(at, experiment), pacer, recorder or mock.Mock(), StopRequest(), _progress)
    except Exception as error:  # noqa: BLE001 - whatever it is, it is looked at
        return f"{error} | {error.__cause__}" if error.__cause__ else str(error) or type(error).__name__
    return ""


def _start_together(outcome: Outcome, one: Callable[[], str], other: Callable[[], str]) -> None:
    """Two hosts begin in the same moment: at most one of them may get to its end."""
    with ThreadPoolExecutor(2) as threads:
        said = [run.result() for run in [threads.submit(each) for each in (one, other)]]
    outcome.said = next(filter(None, said), "")
    if not any(said):
        outcome.problems.append("both went to their end")


def _plc(fault: Fault, host: str, port: int, map_: RegisterMap, **more: Any) -> Plc:
    """Make the PLC's client, with two registers of one kind and type in each other's place where they are exchanged."""
    if fault.kind == "PLC registers exchanged":
        registers = map_.registers
        pairs = [(a, b) for a, b in combinations(registers, 2) if _alike(registers[a]) == _alike(registers[b])]
        a, b = pairs[int(fault.size * len(pairs))]
        moved = {a: registers[a].model_copy(update={"address": registers[b].address})}
        moved[b] = registers[b].model_copy(update={"address": registers[a].address})
        map_ = map_.model_copy(update={"registers": {**registers, **moved}})
    return Plc(host, port, map_, timeout_s=20.0, beat_timeout_s=20.0, **more)


def _alike(register: Register) -> tuple[RegisterKind, str]:
    return register.kind, register.type


def _progress(phase: Phase, time_s: float) -> None:
    """Show nothing."""


def _also(fault: Fault, server: RigServer, stack: ExitStack) -> Callable[[], None]:
    """What somebody else does in a cycle of the fault."""
    if fault.kind == "second host":
        other = stack.enter_context(CanLink.open(server.bus_url))
        data = COMMAND.pack(0x000F, round(800 * fault.size - 400), 0)
        return lambda: other.send(RPDO + fault.drive, data)
    if fault.kind == "clock stepped":
        real, step_s = time.time, 7200.0 * fault.size - 3600.0
        stack.enter_context(mock.patch.object(time, "time", side_effect=lambda: real() + step_s))
    return lambda: None


def _judge_shaft(rig: Rig, man: Man, shaft: Shaft, fastest_rad_s: float, outcome: Outcome) -> None:
    """Sum up how far each torque was outside what the host asked for: beyond the stated impulse nothing may follow."""
    error = rig.guard_limits.error
    own = {
        "limit bit, no torque": NO_TORQUE_S,
        "limit bit, some counts": NO_TORQUE_S,
        "stuck and frozen": rig.guard_limits.feedback_timeout_s,
        "PLC's PRBS ignored": 2.0 * PRBS_S,  # while it is compared with the other drive's
        "PLC's PRBS turned": 2.0 * PRBS_S,
    }
    time_s = own.get(man.kind, error.time_s)  # a drive that shows nothing of it is judged by another row of the table
    for drive, limit_nm in ((0, error.m1_nm), (1, error.m2_nm)):
        impulse = length = 0.0
        for k, (given, _) in enumerate(zip(shaft.torques_nm, man.asked_nm, strict=False)):
            asked = [each[drive] for each in man.asked_nm[max(0, k - 3) : k + 1]]
            off_nm = max(min(asked) - given[drive], given[drive] - max(asked), 0.0)
            if off_nm <= limit_nm + COUNT_NM:
                continue
            if impulse >= 2.0 * limit_nm * time_s:
                length += 1
            impulse += off_nm * rig.period_s
        outcome.zero_s = max(outcome.zero_s, impulse)
        if length > LATE_CYCLES:
            outcome.problems.append(f"m{drive + 1} was wrong by {impulse:.1f} Nm s, {length:.0f} cycles too many")
    fastest = max(map(abs, shaft.speeds_rad_s), default=0.0)
    if man.kind in DEAD_READINGS:
        _judge_dead_reading(rig, shaft, man, outcome)
    elif fastest_rad_s and fastest > 1.3 * fastest_rad_s + SPEED_SLACK_RAD_S:
        outcome.problems.append(f"the shaft turned at {fastest:.1f} rad/s, {fastest_rad_s:.1f} without a fault")


def _judge_dead_reading(rig: Rig, shaft: Shaft, man: Man, outcome: Outcome) -> None:
    """Sum up what no friction holds: a vehicle at rest that reads zero, or a speed that stands, is as good as dead."""
    held_nm, late = ROLLING_RAD_S2 * INERTIA_KG_M2 * FULL, 0
    gained_rad_s = 0.0
    for given in shaft.torques_nm[man.fault_cycle :]:
        late += gained_rad_s >= 2.0 * MOST_HELD_RAD_S
        gained_rad_s += max(abs(sum(given)) - held_nm, 0.0) / (INERTIA_KG_M2 * FULL) * rig.period_s
    if late > LATE_CYCLES + BLOCK_S / rig.period_s:
        outcome.problems.append(f"a dead reading lasted for {gained_rad_s:.2f} rad/s that no friction holds")


def _judge_end(rig: Rig, server: RigServer, fault: Fault, outcome: Outcome) -> None:
    if server.torque_nm != (0.0, 0.0):
        outcome.problems.append(f"torque is left at {server.torque_nm}")
    for number, table in ((1, rig.inverters.m1), (2, rig.inverters.m2)):
        state = power_state(server.bus_url, table.node_id)
        if state not in DISARMED and "fault" not in state.value:
            outcome.problems.append(f"drive m{number} is in {state.value}")
    if fault.kind == "clock stepped" and outcome.said:
        outcome.problems.append(f"a step of the clock ended it: {outcome.said[:200]}")
    named = NAMED.get(fault.kind, r"inverters? m[12]|both inverters|drives|somebody else")
    if outcome.said and not re.search(named, outcome.said):
        outcome.problems.append(f"does not name what is wrong: {outcome.said[:200]}")


def main(arguments: list[str] | None = None) -> int:
    """Draw and judge runs; 1 if one is wrong."""
    asked = asked_for("tests.campaigns.faults.middle", 2000, arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rig = campaign_rig(folder, inertia_kg_m2=INERTIA_KG_M2)

        @cache
        def untouched(experiment: str, plain: str) -> tuple[int, float]:
            outcome, shaft = run_with(rig, experiment, Fault(plain, 1, 1 << 30, "once", 1, 1, 0.0), folder, 0.0)
            if outcome.problems or outcome.said:
                raise AssertionError((experiment, outcome))
            return outcome.steps, max(map(abs, shaft.speeds_rad_s))

        def one(number: int) -> tuple[str, str, Outcome]:
            rng = np.random.default_rng((asked.seed, number))
            experiment = str(rng.choice(EXPERIMENTS))
            kind = KINDS[number % len(KINDS)]
            steps, fastest_rad_s = untouched(
                experiment, next((each for each in PLAIN if kind.startswith(each)), "none")
            )
            fault = drawn(rng, kind, steps)
            if kind in LASTING:
                fault.pattern = "for ever"
            outcome, _ = run_with(rig, experiment, fault, folder, fastest_rad_s)
            return fault.kind, f"in {experiment}, {fault}: {outcome.said[:120] or 'went to its end'}", outcome

        return tried(asked, one, "worst torque error [Nm s]")


if __name__ == "__main__":
    sys.exit(main())
