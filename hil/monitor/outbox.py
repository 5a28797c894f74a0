"""From the cycle to the view without a wait: the cycle leaves things here, a thread of its own sends them."""

from __future__ import annotations

import threading
from collections import deque
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Self

from hil.monitor.messages import Health, Report, Samples
from hil.rig.experiments.base import Phase
from hil.sample import Sample

SEND_EVERY_S = 0.05
"""Twice as often as the view draws."""

KEPT_SAMPLES = 20_000
"""Samples kept for a view that does not take them (a stopped terminal): then the oldest go."""


class Outbox:
    """Reports on their way, from `__enter__` to `__exit__`; a view that is gone is no error of the rig's."""

    def __init__(self, connection: Connection, kept_samples: int = KEPT_SAMPLES) -> None:
        self._connection = connection
        self._samples: deque[tuple[Sample, Phase | None]] = deque(maxlen=kept_samples)
        self._left = 0
        self._gone = 0
        self._reports: deque[Report] = deque()
        self._health: Health | None = None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._send_on, name="to the view", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending.set()
        self._thread.join()

    def sample(self, sample: Sample, phase: Phase | None) -> None:
        """Leave a sample; the oldest is dropped, and counted as lost, where too many wait."""
        self._samples.append((sample, phase))
        self._left += 1

    def health(self, health: Health) -> None:
        """Leave the present health; one that was not sent yet is replaced."""
        self._health = health

    def tell(self, report: Report) -> None:
        """Leave anything else; it is sent behind the samples left before it."""
        self._reports.append(report)

    def _send_on(self) -> None:
        try:
            while not self._ending.wait(SEND_EVERY_S):
                self._send_all()
            self._send_all()
        except OSError:  # the view is gone; who reads its orders learns that too, and ends the rig's process
            return

    def _send_all(self) -> None:
        reports = [self._reports.popleft() for _ in range(len(self._reports))]
        rows = tuple(self._samples.popleft() for _ in range(len(self._samples)))
        health, self._health = self._health, None
        if rows:
            self._gone += len(rows)
            lost = max(0, self._left - self._gone - len(self._samples))
            self._gone += lost
            self._connection.send(Samples(rows, lost))
        if health is not None:
            self._connection.send(health)
        for report in reports:
            self._connection.send(report)
