"""A signal is a request, read where the run wants to read it."""

import os
import signal
from collections.abc import Iterator

import pytest

from hil.rig.stop import STOP_SIGNALS, StopRequest, interrupt_on_signals, stop_on_signals


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


@pytest.fixture
def handlers() -> Iterator[None]:
    """Put all handlers back at the end."""
    before = {number: signal.getsignal(number) for number in STOP_SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_signal_outside_a_run_interrupts(number: signal.Signals) -> None:
    interrupt_on_signals()
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), number)


@pytest.mark.usefixtures("handlers")
def test_program_that_was_started_to_outlive_its_terminal_does() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    stop = StopRequest()
    interrupt_on_signals()
    with stop_on_signals(stop):
        os.kill(os.getpid(), signal.SIGHUP)
    assert not stop.requested
