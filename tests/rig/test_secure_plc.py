"""A whole rig whose PLC speaks Modbus/TCP Security: checked and driven as far as the host's role allows."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from drivers.errors import ConfigMismatch, ProtocolViolation
from hil.config.rig_file import Rig, read_rig
from hil.rig.check import DeviceVerdict, check_rig
from hil.simulator.rig_server import RigServer
from tests.rig.observer import assert_disarmed
from tests.rig.serving import CHANGES, EXAMPLE, Samples, changed, run_once, served
from tests.wire.tls_peers import SERVER_NAME, Authority, der_text

TABLES = """
[plc.security]
ca = "authority.pem"
certificate = "host.pem"
key = "host.key"
server_name = "plc.test"

[simulation.plc_security]
ca = "authority.pem"
certificate = "plc.test.pem"
key = "plc.test.key"
roles = { operator = "read_write", viewer = "read" }
"""


@contextmanager
def secure(folder: Path, role: str, signed_by: str = "authority") -> Iterator[tuple[RigServer, Rig]]:
    """Serve a small rig over TLS; the rig yielded connects with a certificate of this role."""
    authority = Authority(folder)
    authority.issue(SERVER_NAME)
    signer = authority if signed_by == "authority" else Authority(folder, signed_by)
    signer.issue("host", der_text(role))
    path = folder / "rig.toml"
    path.write_text(EXAMPLE.read_text("utf-8") + TABLES, "utf-8")
    with served(changed(read_rig(path), CHANGES)) as pair:
        yield pair


def test_an_operator_drives(tmp_path: Path) -> None:
    samples = Samples()
    with secure(tmp_path, "operator") as (server, rig):
        run_once(rig, samples)
        assert_disarmed(server.bus_url, 1, 2)
    assert len(samples.rows) == 100
    assert {row.flags for row in samples.rows} == {0}


def test_a_viewer_checks_and_can_t_drive(tmp_path: Path) -> None:
    with secure(tmp_path, "viewer") as (server, rig):
        (plc,) = (finding for finding in check_rig(rig) if finding.device == "plc")
        assert plc.verdict is DeviceVerdict.AGREES
        with pytest.raises(ProtocolViolation, match=r"writing .* exception 1 .* of role 'viewer'"):
            run_once(rig, Samples())
        assert_disarmed(server.bus_url, 1, 2)


def test_a_host_of_another_authority_is_not_connected(tmp_path: Path) -> None:
    with secure(tmp_path, "operator", signed_by="stranger") as (server, rig):
        (plc,) = (finding for finding in check_rig(rig) if finding.device == "plc")
        assert plc.verdict is DeviceVerdict.FAILED
        with pytest.raises(ConfigMismatch, match="does not accept this client's certificate"):
            run_once(rig, Samples())
        assert_disarmed(server.bus_url, 1, 2)
