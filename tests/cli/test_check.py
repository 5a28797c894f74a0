"""``hil check``: what a person and a script read of it."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hil.cli.main import run
from hil.config.rig_file import read_rig
from hil.simulator.faults import FaultAtStep, InverterFaults, PlcFaults, RigFaults
from tests.rig.serving import served


@contextmanager
def rig_with(faults: RigFaults, path: Path) -> Iterator[tuple[str, ...]]:
    with served(read_rig(path), faults) as (server, _):
        yield ("check", str(path), "--bus", server.bus_url, "--modbus", str(server.modbus))


def test_complete_rig(short_rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with rig_with(RigFaults(), short_rig) as command:
        assert run(command) == 0
    printed = capsys.readouterr()
    assert printed.out.count("agrees") == 4
    assert printed.err == ""


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_registers_of_the_plc_are_shown_and_one_that_can_not_be_is_refused(
    short_rig: Path, options: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    with rig_with(RigFaults(plc=PlcFaults(swaps_floats=True)), short_rig) as command:
        assert run([*command, *options]) == 3
    printed = capsys.readouterr()
    assert "plc" in printed.err
    if options:
        plc = json.loads(printed.out)["devices"][3]
        held = {each["name"]: each for each in plc["registers"]}
        assert (held["torque_limit"]["value"], held["torque_limit"]["unit"]) == (pytest.approx(400.0), "Nm")
        assert held["torque_limit"]["problem"] is None
        assert "'high_word_first'" in held["speed_limit"]["problem"]
    else:
        rows = {row.split()[1]: row for row in printed.out.splitlines() if "│" in row and len(row.split()) > 1}
        assert "400" in rows["torque_limit"]
        assert "Nm" in rows["torque_limit"]
        assert "not plausible" in rows["speed_limit"]


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_drive_in_fault_is_noted(short_rig: Path, options: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    with rig_with(RigFaults(m1=InverterFaults(fault=FaultAtStep(0, 0x2310))), short_rig) as command:
        assert run([*command, *options]) == 0
    printed = capsys.readouterr().out
    notes = json.loads(printed)["devices"][1]["notes"] if options else [" ".join(printed.split())]
    assert len(notes) == 1
    assert "power state is fault, error code 0x603F is 0x2310 continuous over-current, motor side" in notes[0]
    assert "Fix the cause at the drive, reset the fault." in notes[0]
