"""The simulated PLC asked by `mbpoll`, a Modbus client that nobody here wrote (libmodbus underneath)."""

import re
import shutil
import subprocess
from collections.abc import Iterator

import pytest

from drivers.plc.register_map import load_register_map
from drivers.resources import data_file
from hil.simulator.faults import PlcAnswers, PlcFaults
from hil.simulator.plc_device import IDENTITY, PlcDevice, PlcSetup
from hil.simulator.plc_server import PlcServer

pytestmark = pytest.mark.skipif(shutil.which("mbpoll") is None, reason="mbpoll is not installed (Debian: mbpoll)")

MAP = load_register_map(data_file("plc.toml"))
SETUP = PlcSetup(speed_limit_rad_s=210.25, torque_limit_nm=333.3)
CYCLES = 7

COIL, DISCRETE_INPUT, INPUT, HOLDING = "0", "1", "3", "4"
LINE = re.compile(r"^\[(\d+)\]:\s+(\S+)", re.MULTILINE)
"""One value as mbpoll prints it: ``[9]:     7``."""


@pytest.fixture
def device() -> PlcDevice:
    plc = PlcDevice(SETUP)
    plc.step(CYCLES * SETUP.period_s)
    return plc


@pytest.fixture
def server(device: PlcDevice) -> Iterator[PlcServer]:
    with PlcServer(device, MAP) as served:
        yield served


def mbpoll(
    server: PlcServer, type_: str, address: int, *options: str, write: tuple[str, ...] = (), timeout_s: float = 10.0
) -> str:
    """Ask once, by zero-based address; returns all it printed."""
    command = [
        "mbpoll",
        "-m",
        "tcp",
        "-p",
        str(server.port),
        "-a",
        str(MAP.device_id),
        "-0",
        "-1",
        "-q",
        "-o",
        str(timeout_s),
    ]
    asked = ["-t", type_, "-r", str(address), *options, server.host, *(("--", *write) if write else ())]
    done = subprocess.run([*command, *asked], capture_output=True, text=True, timeout=30, check=False)
    return done.stdout + done.stderr


def read(server: PlcServer, type_: str, address: int, *options: str) -> dict[int, str]:
    printed = mbpoll(server, type_, address, *options)
    values = {int(address): value for address, value in LINE.findall(printed)}
    assert values, printed
    return values


def test_input_registers(server: PlcServer, device: PlcDevice) -> None:
    values = read(server, INPUT, 0, "-c", "6")
    vendor = IDENTITY["vendor_code"]
    series, is_open = 1, 0
    expected = [vendor >> 16, vendor & 0xFFFF, IDENTITY["device_code"], IDENTITY["map_version"], series, is_open]
    assert [int(values[address]) for address in range(6)] == expected


@pytest.mark.parametrize("at_s", [0.0, 1.0])
def test_a_discrete_input(at_s: float) -> None:
    withdrawn = PlcDevice(faults=PlcFaults(permissive_withdrawn_at_s=at_s))
    with PlcServer(withdrawn, MAP) as server:
        assert read(server, DISCRETE_INPUT, MAP["permissive"].address) == {0: "0" if at_s == 0.0 else "1"}


def test_a_holding_register_written_and_read_back(server: PlcServer, device: PlcDevice) -> None:
    address = MAP["prbs_seed"].address
    assert "Written 1 references" in mbpoll(server, HOLDING, address, write=("321",))
    assert device.values()["prbs_seed"] == 321
    assert read(server, HOLDING, address) == {address: "321"}


def test_a_coil_written_and_read_back(server: PlcServer, device: PlcDevice) -> None:
    for state in ("1", "0"):
        assert "Written 1 references" in mbpoll(server, COIL, MAP["prbs_enable"].address, write=(state,))
        assert device.values()["prbs_enable"] is (state == "1")
        assert read(server, COIL, MAP["prbs_enable"].address) == {0: state}


@pytest.mark.parametrize(
    ("type_", "address", "write", "exception"),
    [
        (HOLDING, 5, ("0",), "Illegal data value"),  # a seed of zero
        (HOLDING, 2, ("1",), "Illegal data address"),  # half of a float
        (HOLDING, 7, ("1",), "Illegal data address"),  # behind the map
    ],
)
def test_a_refused_write_shows_the_exception_and_changes_nothing(
    server: PlcServer, device: PlcDevice, type_: str, address: int, write: tuple[str, ...], exception: str
) -> None:
    before = device.values()
    assert exception in mbpoll(server, type_, address, write=write)
    assert device.values() == before


@pytest.mark.parametrize(
    ("answers", "shown"),
    [
        (PlcAnswers.EXCEPTION, "Slave device or server failure"),
        (PlcAnswers.HALF, "Connection timed out"),
        (PlcAnswers.RESET, "Connection reset by peer"),
        (PlcAnswers.TOO_FEW, "Invalid data"),
    ],
)
def test_a_plc_that_fails_fails_for_it_too(answers: PlcAnswers, shown: str) -> None:
    device = PlcDevice(faults=PlcFaults(answers_at_s=frozenset({(0.0, answers)})))
    with PlcServer(device, MAP) as server:
        assert shown in mbpoll(server, INPUT, 0, "-c", "4", timeout_s=1.0)
