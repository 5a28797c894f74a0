"""The certificates of the documentation: its commands run as they stand, and what they make opens a connection."""

from __future__ import annotations

import asyncio
import shutil
import subprocess
from pathlib import Path

import pytest

from drivers.plc.modbus_link import ModbusLink
from drivers.plc.modbus_security import ClientSecurity, Credentials, own_role
from drivers.plc.register import Access, RegisterKind
from drivers.plc.register_map import load_register_map
from drivers.resources import data_file
from hil.simulator.plc_device import PlcDevice
from hil.simulator.plc_server import PlcSecurity, PlcServer
from tests.docs.pages import DOCS, blocks

pytestmark = pytest.mark.skipif(
    shutil.which("openssl") is None or shutil.which("bash") is None, reason="openssl or bash is not installed"
)
MAP = load_register_map(data_file("plc.toml"))


def documented_commands() -> str:
    (block,) = (each for each in blocks(DOCS / "supported-protocols.md") if each.language == "bash")
    return block.text


def test_they_give_a_connection_with_the_role_they_say(tmp_path: Path) -> None:
    command = ["bash", "-euc", documented_commands()]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, timeout=60)
    folder = tmp_path / "certificates"
    host, plc = (Credentials(folder / "ca.pem", folder / f"{n}.pem", folder / f"{n}.key") for n in ("host", "plc"))
    assert own_role(host) == "operator"
    assert own_role(plc) is None

    async def write_and_read(port: int) -> tuple[int, ...]:
        link = ModbusLink("127.0.0.1", port, MAP.device_id, 20.0, ClientSecurity(host, "plc.example"))
        await link.open()
        await link.write(RegisterKind.HOLDING_REGISTER, 5, [9])
        words = await link.read(RegisterKind.HOLDING_REGISTER, 5, 1)
        link.close()
        return words

    with PlcServer(PlcDevice(), MAP, security=PlcSecurity(plc, {"operator": Access.READ_WRITE})) as server:
        assert asyncio.run(write_and_read(server.port)) == (9,)
