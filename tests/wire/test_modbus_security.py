"""Modbus/TCP Security: our client and our simulated PLC, and each of them against OpenSSL's own programs."""

import asyncio
import shutil
import ssl
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import drivers.plc.modbus_dial
from drivers.errors import BusDown, ConfigMismatch, ProtocolViolation
from drivers.plc.modbus_link import ModbusLink
from drivers.plc.modbus_security import ClientSecurity, Credentials, own_role
from drivers.plc.register import Access, RegisterKind
from drivers.plc.register_map import load_register_map
from drivers.resources import data_file
from hil.simulator.plc_device import PlcDevice
from hil.simulator.plc_server import PlcSecurity, PlcServer
from tests.docs.pages import DOCS, blocks
from tests.wire.tls_peers import SERVER_NAME, Authority, der_text, needs_openssl, openssl_exchange, openssl_server

MAP = load_register_map(data_file("plc.toml"))
HOLDING, INPUT, COIL = RegisterKind.HOLDING_REGISTER, RegisterKind.INPUT_REGISTER, RegisterKind.COIL
ROLES = {"operator": Access.READ_WRITE, "viewer": Access.READ}
SEED_ADDRESS = 5
PATIENT_S = 20.0
PRINTABLE_STRING = 0x13
"""Another kind of text in DER: no role."""

READ_SEED = bytes.fromhex("0001 0000 0006 01 03 0005 0001")
WRITE_SEED_7 = bytes.fromhex("0002 0000 0006 01 06 0005 0007")
SEED_IS_1 = bytes.fromhex("0001 0000 0005 01 03 02 0001")
NOT_ALLOWED_TO_READ = bytes.fromhex("0001 0000 0003 01 83 01")
NOT_ALLOWED_TO_WRITE = bytes.fromhex("0002 0000 0003 01 86 01")


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority(tmp_path)


@pytest.fixture
def plc(authority: Authority) -> Iterator[PlcServer]:
    security = PlcSecurity(authority.issue(SERVER_NAME), ROLES)
    with PlcServer(PlcDevice(), MAP, security=security) as server:
        yield server


def with_role(authority: Authority, role: str) -> ClientSecurity:
    return ClientSecurity(authority.issue(role, der_text(role)), SERVER_NAME)


async def read_seed(link: ModbusLink) -> int:
    return (await link.read(HOLDING, SEED_ADDRESS, 1))[0]


def connect_and_read(port: int, security: ClientSecurity | None, timeout_s: float = PATIENT_S) -> int:
    async def run() -> int:
        link = ModbusLink("127.0.0.1", port, MAP.device_id, timeout_s, security)
        await link.open()
        try:
            return await read_seed(link)
        finally:
            link.close()

    return asyncio.run(run())


class TestRoles:
    def test_an_operator_reads_and_writes(self, plc: PlcServer, authority: Authority) -> None:
        async def run() -> None:
            link = ModbusLink("127.0.0.1", plc.port, MAP.device_id, PATIENT_S, with_role(authority, "operator"))
            await link.open()
            await link.write(HOLDING, SEED_ADDRESS, [77])
            await link.write(COIL, 0, [1])
            assert await read_seed(link) == 77
            assert await link.read(COIL, 0, 1) == (1,)
            link.close()

        asyncio.run(run())

    @pytest.mark.parametrize(("kind", "address"), [(HOLDING, SEED_ADDRESS), (COIL, 0)])
    def test_a_viewer_reads_and_can_t_write(
        self, plc: PlcServer, authority: Authority, kind: RegisterKind, address: int
    ) -> None:
        async def run() -> None:
            link = ModbusLink("127.0.0.1", plc.port, MAP.device_id, PATIENT_S, with_role(authority, "viewer"))
            await link.open()
            before = await link.read(kind, address, 1)
            with pytest.raises(ProtocolViolation, match=r"exception 1 \(.*not from a client .* of role 'viewer'\)"):
                await link.write(kind, address, [1 - before[0]])
            assert await link.read(kind, address, 1) == before
            link.close()

        asyncio.run(run())

    @pytest.mark.parametrize(
        ("role", "named"),
        [
            (None, "without a role"),
            (der_text("nobody"), "of role 'nobody'"),
            (der_text("operator", PRINTABLE_STRING), "without a role"),
            (b"operator", "without a role"),
            (der_text("operator") + b"\0", "without a role"),
        ],
        ids=["no extension", "unknown role", "another type", "no DER", "more than one value"],
    )
    def test_without_a_role_the_plc_knows_nothing_is_allowed(
        self, plc: PlcServer, authority: Authority, role: bytes | None, named: str
    ) -> None:
        security = ClientSecurity(authority.issue("client", role), SERVER_NAME)
        with pytest.raises(ProtocolViolation, match=f"exception 1 .*{named}"):
            connect_and_read(plc.port, security)


class TestCertificates:
    def test_the_host_counts_as_the_name_where_none_is_given(self, plc: PlcServer, authority: Authority) -> None:
        assert connect_and_read(plc.port, replace(with_role(authority, "viewer"), server_name=None)) == 1

    def test_a_plc_of_another_name(self, plc: PlcServer, authority: Authority) -> None:
        security = replace(with_role(authority, "viewer"), server_name="pump.test")
        with pytest.raises(ConfigMismatch, match=r"its certificate is for another name: set server_name"):
            connect_and_read(plc.port, security)

    def test_a_plc_of_another_authority(self, plc: PlcServer, tmp_path: Path) -> None:
        stranger = with_role(Authority(tmp_path, "stranger"), "operator")
        with pytest.raises(ConfigMismatch, match="its certificate is not signed by the authority of 'ca'"):
            connect_and_read(plc.port, stranger)

    @pytest.mark.parametrize("newest", [ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3])
    def test_a_client_without_a_certificate(
        self, plc: PlcServer, authority: Authority, monkeypatch: pytest.MonkeyPatch, newest: ssl.TLSVersion
    ) -> None:
        def bare(credentials: Credentials) -> ssl.SSLContext:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
            context.load_verify_locations(credentials.ca)
            context.maximum_version = newest
            return context

        monkeypatch.setattr(drivers.plc.modbus_dial, "client_context", bare)
        with pytest.raises(ConfigMismatch, match="closed without a word"):
            connect_and_read(plc.port, with_role(authority, "operator"))


def test_a_handshake_may_take_longer_than_an_answer(plc: PlcServer, authority: Authority) -> None:
    """The other side begins its TLS half a second after the connection; an answer may take a tenth of that."""
    late_s = 0.5

    async def relay(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await asyncio.sleep(late_s)
        plc_reader, plc_writer = await asyncio.open_connection("127.0.0.1", plc.port)
        await asyncio.gather(_pump(reader, plc_writer), _pump(plc_reader, writer))

    async def run() -> None:
        async with await asyncio.start_server(relay, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            link = ModbusLink("127.0.0.1", port, MAP.device_id, late_s / 10, with_role(authority, "viewer"))
            await link.open()
            assert link.connected
            link.close()
            await asyncio.sleep(0.1)

    asyncio.run(run())


async def _pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(4096):
        writer.write(data)
    writer.close()


class TestOnlyOneSideSpeaksTls:
    def test_a_plain_plc(self, authority: Authority, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(drivers.plc.modbus_dial, "HANDSHAKE_S", 1.0)
        with PlcServer(PlcDevice(), MAP) as server:
            with pytest.raises(ConfigMismatch, match="nothing that is TLS: is it the port of plain Modbus TCP"):
                connect_and_read(server.port, with_role(authority, "viewer"), timeout_s=1.0)

    def test_a_plain_client(self, plc: PlcServer) -> None:
        with pytest.raises(BusDown, match=r"whether it wants TLS: then it needs \[plc\.security\]"):
            connect_and_read(plc.port, None)


@needs_openssl
class TestOpensslAsPlc:
    """A server that says why it refuses, in a TLS alert; ours does not come to it before asyncio hangs up."""

    def test_it_does_not_know_the_client_s_authority(self, authority: Authority, tmp_path: Path) -> None:
        stranger = Authority(tmp_path, "stranger").issue("client", der_text("operator"))
        security = ClientSecurity(replace(stranger, ca=authority.path), SERVER_NAME)
        with openssl_server(authority.issue(SERVER_NAME)) as port:
            with pytest.raises(ConfigMismatch, match="does not know the authority that signed this client's"):
                connect_and_read(port, security)

    def test_it_got_no_certificate(self, authority: Authority, monkeypatch: pytest.MonkeyPatch) -> None:
        def bare(credentials: Credentials) -> ssl.SSLContext:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
            context.load_verify_locations(credentials.ca)
            return context

        monkeypatch.setattr(drivers.plc.modbus_dial, "client_context", bare)
        with openssl_server(authority.issue(SERVER_NAME)) as port:
            with pytest.raises(ConfigMismatch, match="requires a client certificate and got none"):
                connect_and_read(port, with_role(authority, "operator"))


@needs_openssl
class TestOpensslAsClient:
    """Frames by hand, over somebody else's TLS."""

    @pytest.mark.parametrize("version", ["-tls1_2", "-tls1_3"])
    @pytest.mark.parametrize(
        ("role", "request_", "answer"),
        [
            ("viewer", READ_SEED, SEED_IS_1),
            ("viewer", WRITE_SEED_7, NOT_ALLOWED_TO_WRITE),
            ("operator", WRITE_SEED_7, WRITE_SEED_7),
            ("nobody", READ_SEED, NOT_ALLOWED_TO_READ),
        ],
    )
    def test_what_a_role_may_do(
        self, plc: PlcServer, authority: Authority, version: str, role: str, request_: bytes, answer: bytes
    ) -> None:
        credentials = authority.issue(role, der_text(role))
        assert openssl_exchange(plc.port, credentials, request_, version) == answer

    def test_older_than_1_2_gets_no_connection(self, plc: PlcServer, authority: Authority) -> None:
        credentials = authority.issue("operator", der_text("operator"))
        old = ("-tls1_1", "-cipher", "ALL:@SECLEVEL=0")
        assert openssl_exchange(plc.port, credentials, READ_SEED, *old) == b""


pytestmark = pytest.mark.skipif(
    shutil.which("openssl") is None or shutil.which("bash") is None, reason="openssl or bash is not installed"
)


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
