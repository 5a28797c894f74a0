"""What the rig's process and the view tell each other; plain values that can be sent from one to the other.

::

    rig  -> view   Samples, Health, Notice, Ready, Began, Over, Lost, Ended
    view -> rig    StartExperiment, Stop, Mark, Reset, Quit
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from drivers.plc.types import PlcStatus
from hil.rig.experiments.base import Phase
from hil.sample import Sample


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples since the last message, oldest first, each with its phase; None while nothing is driven."""

    rows: tuple[tuple[Sample, Phase | None], ...]  # never empty
    lost: int = 0  # samples not sent since the view did not take them; they are in the recording all the same


@dataclass(frozen=True, slots=True)
class NodeHealth:
    """One inverter, as the bus shows it."""

    node_id: int  # CANopen node
    power: str | None  # state of its power stage in the words of CiA 402; None before the first TPDO
    nmt: str | None  # NMT state of its last heartbeat
    heartbeat_age_s: float | None  # time since its last heartbeat [s]; None where there was none
    heartbeat_limit_s: float  # age beyond which the heartbeat counts as missing [s]
    tpdo_age_s: float | None  # time since its last TPDO [s]; None where there was none
    emergency: str | None  # the active EMCY in words, or None
    n_emergencies: int  # EMCY frames since the monitor began, resets not counted
    trouble: str | None  # why it could not be configured, or None


@dataclass(frozen=True, slots=True)
class PlcHealth:
    """The PLC: its last status, how old that is [s], and what keeps the next from coming."""

    status: PlcStatus | None  # None before the first
    age_s: float | None  # None where there is no status
    trouble: str | None  # in words; None where nothing does


@dataclass(frozen=True, slots=True)
class TimingHealth:
    """The cycle since the present stretch (listening, or one run) began; times in seconds, NaN while there is none."""

    period_s: float  # what it should be
    cycles: int  # that took place
    missed: int  # that did not
    late: int  # that began later than half a period
    unanswered: int  # answers that did not come in time, of either inverter
    lateness_s: tuple[float, float, float]  # median, 99th percentile and largest
    reply_s: tuple[float, float, float]  # the same of the time from SYNC to answer


@dataclass(frozen=True, slots=True)
class Health:
    """Both inverters, the PLC and the cycle."""

    m1: NodeHealth  # inverter m1
    m2: NodeHealth  # inverter m2
    plc: PlcHealth  # by its last status
    timing: TimingHealth  # of the present stretch


class LogTopic(Enum):
    """What a line of the log is about; the value is what stands before it."""

    INFO = "info"
    RUN = "run"
    MARK = "mark"
    EMCY = "EMCY"
    ALARM = "ALARM"
    FAULT = "FAULT"


@dataclass(frozen=True, slots=True)
class Notice:
    """One thing that happened, on the host's monotonic clock [ns]."""

    t_ns: int  # when, not when it was shown
    kind: LogTopic  # INFO alone is not shown as the message of the screen
    text: str  # what the log shows behind its age and topic


@dataclass(frozen=True, slots=True)
class Began:
    """An experiment begins; ``recording`` is where it will be."""

    experiment: str  # its name in the rig file; empty where a recording is played
    recording: str
    duration_s: float  # of the measured part; of a recording, of all of it


@dataclass(frozen=True, slots=True)
class Over:
    """An experiment is over, the drives are disarmed."""

    experiment: str  # its name in the rig file; empty where a recording was played
    recording: str | None  # where its samples are; None where nothing was recorded
    samples: int  # of the measured part
    flagged: int  # of these, with a flag
    stopped: bool  # whether someone asked for its end
    reason: str | None  # what ended it before its time
    run_id: int | None = None  # its number in the run store
    alarms: int = 0  # changes of the driveline that the on-line estimate found


@dataclass(frozen=True, slots=True)
class Lost:
    """The bus is gone; the rig's process keeps trying."""

    reason: str  # in words


@dataclass(frozen=True, slots=True)
class Ready:
    """The rig is there (again) and is listened to."""


@dataclass(frozen=True, slots=True)
class Ended:
    """Nothing follows: the source has ended, by itself or since it was asked to.

    ``error`` says why it could not continue.
    """

    error: str | None = None


@dataclass(frozen=True, slots=True)
class StartExperiment:
    """Start an experiment of the rig file."""

    experiment: str  # its name in the rig file


@dataclass(frozen=True, slots=True)
class Stop:
    """End the experiment at once, at zero torque."""


@dataclass(frozen=True, slots=True)
class Mark:
    """Something worth remembering happened at ``t_ns`` of the host's monotonic clock."""

    t_ns: int
    text: str  # what the operator typed


@dataclass(frozen=True, slots=True)
class Reset:
    """Reset the drives' faults and configure them again; while nothing is driven."""


@dataclass(frozen=True, slots=True)
class Quit:
    """End: the experiment first, at zero torque, then the rig's process."""


Report = Samples | Health | Notice | Ready | Began | Over | Lost | Ended
Order = StartExperiment | Stop | Mark | Reset | Quit


@dataclass(frozen=True, slots=True)
class Choice:
    """An experiment as it is offered: its name, and what it will command, in words."""

    name: str  # NAME of [experiments.NAME]
    summary: str  # several lines


def outcome(over: Over) -> str:
    """Tell in one line how a run went; its file comes last, for its name may be long."""
    ended = "stopped by the operator" if over.stopped else "done"
    kept = "nothing recorded" if over.recording is None else _kept(over, over.recording)
    if over.reason is not None:
        return f"{over.experiment} ENDED EARLY: {over.reason.rstrip('.')} ({kept})"
    return f"{over.experiment} {ended}: {kept}"


def _kept(over: Over, recording: str) -> str:
    parts = [f"{over.samples} samples"]
    parts += [f"{over.flagged} flagged"] if over.flagged else []
    parts += [f"{over.alarms} {'ALARM' if over.alarms == 1 else 'ALARMS'}"] if over.alarms else []
    parts += [] if over.run_id is None else [f"run {over.run_id}"]
    return f"{', '.join(parts)}, {as_known(recording)}"


def as_known(path: str) -> str:
    """Name a file as a person in this folder would: from here on where it is inside, else whole."""
    here = Path.cwd()
    return str(Path(path).relative_to(here)) if Path(path).is_relative_to(here) else path
