"""Faults of the simulated PLC by name, and what each does on the wire to a bare socket."""

from __future__ import annotations

import socket

import pytest

from drivers.plc.register_map import load_register_map
from drivers.resources import data_file
from hil.simulator.fault_table import known_faults, rig_faults
from hil.simulator.faults import LATE_BY_S, PlcFaults
from hil.simulator.plc_device import PlcDevice
from hil.simulator.plc_server import PlcServer

MAP = load_register_map(data_file("plc.toml"))
READ_TWO = bytes.fromhex("0001 0000 0006 01 04 0002 0002")
TWO = bytes.fromhex("0001 0000 0007 01 04 04 2024 0001")
ONE = bytes.fromhex("0001 0000 0005 01 04 02 2024")
DEVICE_FAILURE = bytes.fromhex("0001 0000 0003 01 84 04")


@pytest.mark.parametrize(
    ("name", "field"),
    [
        ("exception", "exceptions_at_s"),
        ("slow", "late_at_s"),
        ("half_answer", "half_at_s"),
        ("reset", "resets_at_s"),
        ("wrong_width", "too_few_at_s"),
        ("wrong_unit", "wrong_unit_at_s"),
        ("wrong_transaction", "wrong_transaction_at_s"),
    ],
)
def test_each_is_put_into_the_device_by_name(name: str, field: str) -> None:
    assert f"{name}@S" in known_faults()
    assert rig_faults([f"plc.{name}@2.5"], 0.01).plc == PlcFaults(**{field: 2.5})


def answer_of(faults: PlcFaults, timeout_s: float) -> bytes:
    with PlcServer(PlcDevice(faults=faults), MAP) as server:
        with socket.create_connection((server.host, server.port), timeout=timeout_s) as client:
            client.sendall(READ_TWO)
            return client.recv(64)


@pytest.mark.parametrize(
    ("faults", "answer"),
    [
        (PlcFaults(), TWO),
        (PlcFaults(exceptions_at_s=0.0), DEVICE_FAILURE),
        (PlcFaults(half_at_s=0.0), TWO[: len(TWO) // 2]),
        (PlcFaults(too_few_at_s=0.0), ONE),
        (PlcFaults(late_at_s=0.0), TWO),
        (PlcFaults(wrong_unit_at_s=0.0), TWO[:6] + b"\x81" + TWO[7:]),
        (PlcFaults(wrong_transaction_at_s=0.0), b"\x80" + TWO[1:]),
    ],
)
def test_what_comes_back(faults: PlcFaults, answer: bytes) -> None:
    assert answer_of(faults, timeout_s=10.0) == answer


def test_a_slow_one_is_later_than_a_client_waits() -> None:
    assert LATE_BY_S > 1.0
    with pytest.raises(TimeoutError):
        answer_of(PlcFaults(late_at_s=0.0), timeout_s=1.0)


def test_a_reset_is_a_reset_and_no_end() -> None:
    with pytest.raises(ConnectionResetError):
        answer_of(PlcFaults(resets_at_s=0.0), timeout_s=10.0)
