"""A signal is a request, read where the run wants to read it."""

from __future__ import annotations

import os
import signal

import pytest

from hil.rig.stop import STOP_SIGNALS, StopRequest, stop_on_signals


def test_nothing_happens_unasked() -> None:
    StopRequest().raise_if_requested()


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_signal_ends_the_run_at_the_next_look_and_not_before(number: signal.Signals) -> None:
    stop = StopRequest()
    looked = []
    with stop_on_signals(stop):
        os.kill(os.getpid(), number)
        looked.append("after the signal")
        with pytest.raises(KeyboardInterrupt):
            stop.raise_if_requested()
    assert looked == ["after the signal"]


def test_handlers_are_put_back() -> None:
    before = [signal.getsignal(number) for number in STOP_SIGNALS]
    with stop_on_signals(StopRequest()):
        pass
    assert [signal.getsignal(number) for number in STOP_SIGNALS] == before
