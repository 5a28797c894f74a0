"""Compiling ahead: the on-line chain takes seconds the first time, and neither screen nor run shall wait for it.

The machine code goes to a cache on disk (`estimator.compiled`), so that another process can make it, at low priority;
in this one compiling would keep the interpreter from the screen. What is left to do here is to load it.
"""

from __future__ import annotations

import multiprocessing
import os
import threading

from estimator.errors import EstimatorError
from hil.child import safe_path
from hil.rig.live import USUAL, OnlineSetup, tracking_chain

SAMPLES = 64

NICE = 10
"""The cycle and the screen come first."""


class WarmUp:
    """Makes the on-line chain ready, from a thread that begins at once and ends with the program.

    Parameters
    ----------
    period_s
        Time between two samples [s].
    setup
        What estimates; each structure of model has its own machine code.
    """

    def __init__(self, period_s: float, setup: OnlineSetup = USUAL) -> None:
        self._of = (period_s, setup)
        self._failed: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="compiling", daemon=True)
        self._thread.start()

    def is_done(self) -> bool:
        """Tell whether the chain is ready."""
        if self._failed is not None:
            raise self._failed
        return not self._thread.is_alive()

    def _run(self) -> None:
        process = multiprocessing.get_context("spawn").Process(target=_compile, args=self._of, daemon=True)
        with safe_path():
            process.start()
        process.join()
        try:
            run_once(*self._of)
        except Exception as error:  # noqa: BLE001 - raised where someone asks: a thread's own is lost
            self._failed = error


def run_once(period_s: float, setup: OnlineSetup = USUAL) -> None:
    """Run the chain on nothing; a period that has no chain has none to compile, and the view says so in a run."""
    try:
        chain = tracking_chain(period_s, *setup)
    except EstimatorError:
        return
    for number in range(SAMPLES):
        chain.push(number * period_s, 0.0, 0.0)


def _compile(period_s: float, setup: OnlineSetup) -> None:
    if hasattr(os, "nice"):
        os.nice(NICE)
    run_once(period_s, setup)
