"""Rigs that are not as they should be: ``hil run`` and ``hil check`` end with status 3, drives disarmed.

Each fault is written as for ``hil sim --fault``. What happens inside a run is looked at in
``tests/rig/test_session_ends_early.py``; here it is what a person at the rig sees and a script reads.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hil.cli.main import run
from hil.config.rig_file import read_rig
from hil.recording import read_table
from hil.recording.description import sidecar_of
from hil.rig.live_course import course_path
from hil.simulator.fault_table import rig_faults
from hil.store import store_of
from tests.bad_input.conftest import Refused
from tests.chosen import campaign
from tests.rig.observer import assert_disarmed
from tests.rig.serving import served

NOWHERE = ("--bus", "ws://127.0.0.1:9/", "--modbus", "127.0.0.1:9")

WITHIN_S = 3.5
"""Of simulated time since power-on: inside the measured part of the short rig's reversal."""


@contextmanager
def rig_with(rig: Path, *faults: str) -> Iterator[tuple[str, ...]]:
    """Serve the rig with faults; yields the options with which a command finds it."""
    file = read_rig(rig)
    with served(file, rig_faults(faults, file.period_s)) as (server, _):
        yield ("--bus", server.bus_url, "--modbus", str(server.modbus))


@pytest.mark.parametrize(
    ("fault", "said", "alive"),
    [
        ("m1.absent", ["inverter m1 (node 1): no SDO answer", "Check that the drive is powered"], (2,)),
        campaign(("m2.hang@0", ["inverter m2 (node 2): no SDO answer", "Check that the drive is powered"], (1,))),
        campaign(("m2.wrong_identity", ["vendor-ID 0x1018:01 is 0x00000BAD, expected 0x000003E7 (rig file)"], (1, 2))),
        campaign(
            ("m1.refuse_mode", ["inverter m1 (node 1): mode of operation is 0", "expected 10 (cyclic synch"], (1, 2))
        ),
        campaign(
            ("m2.stuck", ["inverter m2 (node 2): power state is switch on disabled", "expected ready to sw"], (1, 2))
        ),
        ("plc.clutch_closes@0", ["clutch is closed, expected open. Nothing was armed"], (1, 2)),
        campaign(
            ("plc.permissive_withdrawn@0", ["permissive is withdrawn, expected present. Nothing was armed"], (1, 2))
        ),
        ("plc.hang@0", ["PLC at 127.0.0.1", "expected an answer within 5 s, none came"], (1, 2)),
    ],
)
def test_what_is_wrong_from_the_start_is_not_driven(
    refused: Refused, short_rig: Path, fault: str, said: list[str], alive: tuple[int, ...]
) -> None:
    out = short_rig.parent / "run.csv"
    with rig_with(short_rig, fault) as addresses:
        complaint = refused("run", short_rig, "reversal", "--out", out, "--pace", "fast", *addresses, status=3)
        assert_disarmed(addresses[1], *alive)
    assert all(each in complaint for each in said), complaint
    assert list(short_rig.parent.iterdir()) == [short_rig]


@pytest.mark.parametrize(
    ("fault", "said", "alive"),
    [
        ("m2.hang", ["not every drive is confirmed disarmed: m2: ", "cut the power", "What ended the run"], (1,)),
        ("plc.clutch_closes", ["clutch is closed, expected open. The run was ended at zero torque"], (1, 2)),
        campaign(
            ("plc.permissive_withdrawn", ["permissive is withdrawn, expected present. The run was ended"], (1, 2))
        ),
        campaign(("plc.mode_changes", ["drive mode is electric, expected series as at the start"], (1, 2))),
        campaign(("plc.hang", ["PLC"], (1, 2))),
    ],
)
def test_what_goes_wrong_within_ends_the_run_and_keeps_the_recording(
    short_rig: Path, capsys: pytest.CaptureFixture[str], fault: str, said: list[str], alive: tuple[int, ...]
) -> None:
    out = short_rig.parent / "run.csv"
    with rig_with(short_rig, f"{fault}@{WITHIN_S}") as addresses:
        assert run(["run", str(short_rig), "reversal", "--out", str(out), "--pace", "fast", *addresses]) == 3
        assert_disarmed(addresses[1], *alive)
    complaint = capsys.readouterr().err
    assert all(each in complaint for each in said), complaint
    assert 0 < len(read_table(out).columns["time_s"]) < 300
    assert set(short_rig.parent.iterdir()) == {short_rig, out, sidecar_of(out), course_path(out), store_of(out.parent)}


@pytest.mark.parametrize("command", [("check",), ("run", "reversal", "--out", "run.csv")])
def test_a_rig_that_is_not_there(short_rig: Path, command: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    name, *rest = (word.replace("run.csv", str(short_rig.parent / "run.csv")) for word in command)
    assert run([name, str(short_rig), *rest, *NOWHERE]) == 3
    printed = capsys.readouterr()
    said = " ".join((printed.out + printed.err).split())
    assert "CAN bus 'ws://127.0.0.1:9/' can't be opened: [Errno 111] Connection refused" in said
    assert list(short_rig.parent.iterdir()) == [short_rig]
