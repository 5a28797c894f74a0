"""Where reports come from: a rig in a process of its own, or a recording that is played; and the way between."""

from __future__ import annotations

import math
import multiprocessing
import time
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import wait
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from hil.child import safe_path
from hil.errors import RecordingError
from hil.monitor.host import HostJob, serve
from hil.monitor.messages import Began, Ended, Order, Over, Quit, Report, Samples
from hil.recording import columns
from hil.recording.formats import read_table
from hil.recording.table import ColumnKind, Table
from hil.rig.experiments.base import Phase
from hil.rig.pacing import NS_PER_S
from hil.sample import Sample, SampleFlag

LONGEST_END_S = 30.0
"""Time for the rig's process to end [s]: every wait in it is bounded, and disarming two dead drives takes seconds."""

HARD_END = (
    "the rig's process ended without saying that the drives are disarmed. They stop by themselves when the host's "
    "heartbeat is gone; see that they did (hil check), before anyone goes near the shaft."
)

OPTIONAL = (columns.REFERENCE, "prbs_nm", columns.FLAGS)
"""Columns a recording may lack; zero stands for them."""


class RigSource:
    """A rig in a process of its own, from `__enter__` to `__exit__`.

    The rig's process is never killed from here: it is what takes the torque away.
    """

    can_drive = True
    """Whether there is a rig that takes orders."""

    def __init__(self, job: HostJob) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would share this program's terminal and threads
        self._connection, self._far_end = context.Pipe()
        self._process = context.Process(target=serve, args=(job, self._far_end), name="hil rig")
        self._ended = False
        self._last_words: list[Report] = []

    def __enter__(self) -> Self:
        with safe_path():
            self._process.start()
        self._far_end.close()  # or its process's end would not be seen here
        return self

    @property
    def pid(self) -> int | None:
        """Of the rig's process."""
        return self._process.pid

    def poll(self) -> Sequence[Report]:
        """Give what has come; `Ended` last, also where the process ended without a word."""
        reports, self._last_words = self._last_words, []
        while not self._ended:
            try:
                if not self._connection.poll():
                    break
                report: Report = self._connection.recv()
            except (EOFError, OSError):
                report = Ended(HARD_END)
            self._ended = isinstance(report, Ended)
            reports.append(report)
        return reports

    def send(self, order: Order) -> None:
        """Give an order; one that the process can't take any more is reported by `poll`."""
        if self._ended:
            return
        try:
            self._connection.send(order)
        except OSError:
            return

    def await_end(self) -> None:
        """Return once the rig's process has ended, at the latest after `LONGEST_END_S`; from any thread."""
        wait([self._process.sentinel], LONGEST_END_S)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.send(Quit())
        until = time.monotonic() + LONGEST_END_S
        while self._process.is_alive() and time.monotonic() < until:
            self._last_words = [*self.poll()]  # it may wait for room to tell its last
            self._process.join(0.02)
        self._last_words = [*self.poll()]
        if self._process.is_alive():
            self._last_words.append(Ended(f"after {LONGEST_END_S:g} s {HARD_END}"))
        self._connection.close()


class ReplaySource:
    """Plays samples; `poll` gives those that are due."""

    can_drive = False

    def __init__(
        self,
        name: str,
        samples: Sequence[Sample],
        speed: float = 1.0,
        measured: Callable[[Sample], bool] | None = None,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._name = name
        self._samples = samples
        self._speed = speed
        self._measured = measured
        self._clock_ns = clock_ns
        self._next = 0
        self._began_ns = 0
        self._over = False

    def __enter__(self) -> Self:
        self._began_ns = self._clock_ns()
        return self

    def poll(self) -> Sequence[Report]:
        """Give the samples that are due, framed by beginning and end of the recording."""
        if self._over:
            return ()
        reports: list[Report] = []
        if self._next == 0:
            duration_s = self._samples[-1].time_s - self._samples[0].time_s
            reports.append(Began("", self._name, duration_s))
        upto = self._due()
        if upto > self._next:
            due = self._samples[self._next : upto]
            is_measured = self._measured or (lambda sample: True)  # nothing else is recorded
            reports.append(Samples(tuple((row, Phase.MEASURE if is_measured(row) else None) for row in due)))
            self._next = upto
        if upto == len(self._samples):
            self._over = True
            flagged = sum(bool(sample.flags) for sample in self._samples)
            reports.append(Over("", self._name, upto, flagged, stopped=False, reason=None))
        return reports

    def send(self, order: Order) -> None:
        """Do nothing: there is no rig."""

    def await_end(self) -> None:
        """Return at once: nothing drives."""

    def _due(self) -> int:
        passed_s = (self._clock_ns() - self._began_ns) / NS_PER_S * self._speed
        until_s = self._samples[0].time_s + passed_s
        upto = self._next
        while upto < len(self._samples) and self._samples[upto].time_s <= until_s:
            upto += 1
        return upto

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over = True


Source = RigSource | ReplaySource
"""What the view watches, a context manager: `poll` never waits."""


def recorded_samples(path: Path) -> tuple[list[Sample], dict[str, str]]:
    """Read the samples of a rig's own recording, and column and unit of each of its further channels."""
    table = read_table(path)
    needed = table.numeric((columns.TIME, columns.TORQUE_M1, columns.TORQUE_M2, columns.SPEED))
    n = table.n_rows
    given = table.numeric(name for name in OPTIONAL if name in table.columns)
    if not np.all(np.diff(needed[columns.TIME]) > 0.0):
        raise RecordingError(path, f"column {columns.TIME}: expected values that rise, got some that do not")
    channels = {name: table.units[name] for name in table.units if name not in columns.UNITS and _is_read(table, name)}
    further = table.numeric(channels)
    zero = np.zeros(n)
    rows = zip(
        needed[columns.TIME].tolist(),
        needed[columns.TORQUE_M1].tolist(),
        needed[columns.TORQUE_M2].tolist(),
        needed[columns.SPEED].tolist(),
        *(given.get(name, zero).tolist() for name in OPTIONAL),
        *(further[name].tolist() for name in channels),
        strict=True,
    )
    return list(_samples(rows)), channels


def _is_read(table: Table, name: str) -> bool:
    return name in table.columns and ColumnKind.of(table.columns[name]) is not ColumnKind.TEXT


def _samples(rows: Iterator[tuple[float, ...]]) -> Iterator[Sample]:
    for cycle, (time_s, torque_m1, torque_m2, speed, reference, prbs, flags, *channels) in enumerate(rows):
        yield Sample(
            cycle=cycle,
            t_ns=round(time_s * NS_PER_S),
            time_s=time_s,
            torque_ref_m1_nm=reference / 2.0,
            torque_ref_m2_nm=reference / 2.0,
            prbs_nm=prbs,
            torque_m1_nm=torque_m1,
            torque_m2_nm=torque_m2,
            speed_rad_s=speed,
            age_ns=0,
            flags=SampleFlag.GOOD if math.isnan(flags) else SampleFlag(int(flags)),
            channels=tuple(channels),
        )
