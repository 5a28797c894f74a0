"""``hil sim``: one line when ready, a clean end on a signal, and refusals."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hil.cli.main import run


@pytest.mark.parametrize(
    "number",
    [signal.SIGHUP, *(pytest.param(number, marks=pytest.mark.campaign) for number in (signal.SIGINT, signal.SIGTERM))],
)
def test_serves_until_a_signal_and_prints_one_line(
    simulate: Callable[..., Any], short_rig: Path, number: signal.Signals
) -> None:
    simulation = simulate(short_rig)
    assert simulation.bus.startswith("ws://127.0.0.1:")
    assert not simulation.bus.endswith(":0/")
    simulation.process.send_signal(number)
    rest, complaints = simulation.process.communicate(timeout=60)
    assert simulation.process.returncode == 0
    assert (rest, complaints) == ("", "")


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--bus", "ws://0.0.0.0:0/"), "this machine only"),
        (("--bus", "socketcan:can0"), "expected ws://HOST:PORT/"),
        (("--modbus", "10.0.0.1:502"), "this machine only"),
        (("--modbus", "nonsense"), "expected HOST:PORT"),
        (("--effect", "backlash:gap"), "expected key=number"),
        (("--effect", "gremlins"), "gremlins"),
    ],
)
def test_refuses_what_it_can_t_serve(
    short_rig: Path, options: tuple[str, ...], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["sim", str(short_rig), *options]) == 2
    printed = capsys.readouterr()
    assert named in printed.err
    assert printed.out == ""
