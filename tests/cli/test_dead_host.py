"""A host that dies in the middle of a run: the drives stop by themselves, seen by a third node on the bus."""

import json
import queue
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivers.canopen.can_link import CanLink
from drivers.inverter.cia402 import TORQUE_STATES, PowerState, state_of
from hil.cli.main import run
from hil.config.rig_file import read_rig
from hil.simulator.fault_table import rig_faults
from tests.rig.observer import assert_disarmed, power_state
from tests.rig.serving import addresses, served

PATIENCE_S = 60.0


def await_operation(bus: str) -> None:
    """Listen to the TPDOs of drive 1, whose first object is the statusword; the host's own SDO is left alone."""
    states: queue.Queue[PowerState] = queue.Queue()
    with CanLink.open(bus) as link:
        link.subscribe(0x181, lambda data, t_ns: states.put(state_of(int.from_bytes(data[:2], "little"))))
        while states.get(timeout=PATIENCE_S) is not PowerState.OPERATION_ENABLED:
            pass


def await_end_of_operation(bus: str, node_id: int) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while (state := power_state(bus, node_id)) in TORQUE_STATES:
        assert time.monotonic() < deadline_s, f"drive {node_id} is still {state.value}"
        time.sleep(0.02)


@pytest.mark.parametrize("death", [signal.SIGKILL, pytest.param(signal.SIGSTOP, marks=pytest.mark.campaign)])
def test_drives_of_a_host_that_dies_leave_operation(
    simulate: Callable[..., Any], spawn: Callable[..., subprocess.Popen[str]], short_rig: Path, death: signal.Signals
) -> None:
    """Killed, or suspended as by a debugger: the heartbeat ends, and with it the torque; the rig stays up."""
    simulation = simulate(short_rig, "--real-time")
    out = short_rig.parent / "run.csv"
    host = spawn("run", str(short_rig), "cruise", "--out", str(out), *simulation.addresses)
    await_operation(simulation.bus)
    host.send_signal(death)
    for node_id in (1, 2):
        await_end_of_operation(simulation.bus, node_id)
    assert simulation.process.poll() is None
    simulation.process.send_signal(signal.SIGTERM)
    assert simulation.process.communicate(timeout=60) == ("", "")
    assert simulation.process.returncode == 0


@pytest.fixture
def quick_rig(short_rig: Path) -> Path:
    """The short rig with drives that miss their host's commands soon."""
    text = short_rig.read_text(encoding="utf-8")
    short_rig.write_text(text.replace("# rpdo_deadline_ms = 150 ", "rpdo_deadline_ms = 50 "), encoding="utf-8")
    assert read_rig(short_rig).inverters.m1.rpdo_deadline_ms == 50
    return short_rig


def test_hil_check_proves_it_without_a_torque(
    quick_rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    proof = tmp_path / "proof.json"
    with served(read_rig(quick_rig)) as (server, _):
        assert run(["check", str(quick_rig), "--prove-stop", "--out", str(proof), *addresses(server)]) == 0
        assert_disarmed(server.bus_url, 1, 2)
        assert server.torque_nm == (0.0, 0.0)
    assert capsys.readouterr().out.count("agrees") == 4
    kept = json.loads(proof.read_text())
    assert {device["result"] for device in kept["devices"]} == {"agrees"}
    assert any("EMCY" in json.dumps(device["protections"]) for device in kept["devices"])
    assert kept["made"]["models"][0]["file"] == str(quick_rig)


def test_hil_check_names_what_it_can_not_prove(quick_rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = read_rig(quick_rig)
    without_emergencies = rig_faults(["bus.lose=1:0x082"], file.period_s)  # those of node 2
    with served(file, without_emergencies) as (server, _):
        assert run(["check", str(quick_rig), "--prove-stop", "--json", *addresses(server)]) == 3
        assert_disarmed(server.bus_url, 1, 2)
    devices = {device["name"]: device for device in json.loads(capsys.readouterr().out)["devices"]}
    assert devices["m1"]["result"] == "agrees"
    assert [each["what"] for each in devices["m2"]["differences"]] == [
        "stop without commands",
        "stop without heartbeat",
    ]
    assert devices["m2"]["differences"][0]["found"] == (
        "no EMCY, power state switch on disabled; the entry that failed is RPDO event timer 0x1400:05"
    )
