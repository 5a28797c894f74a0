"""Certificates made for a test, and peers that speak TLS with them."""

import ipaddress
import os
import select
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from drivers.plc.modbus_security import Credentials
from tests.drivers.modbus_peers import free_port

ROLE = x509.ObjectIdentifier("1.3.6.1.4.1.50316.802.1")
SERVER_NAME = "plc.test"

UTF8_STRING = 0x0C
"""Tag of a UTF8String, ITU-T X.690."""


def der_text(text: str, tag: int = UTF8_STRING) -> bytes:
    """Encode a short text in DER by hand, so that nothing under test encodes its own test."""
    content = text.encode()
    assert len(content) < 128
    return bytes([tag, len(content)]) + content


class Authority:
    """A certificate authority in a folder."""

    def __init__(self, folder: Path, name: str = "authority") -> None:
        self._folder = folder
        self._key = ec.generate_private_key(ec.SECP256R1())
        self._name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        builder = self._builder(self._name, self._key, timedelta(days=1))
        certificate = builder.add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True).sign(
            self._key, hashes.SHA256()
        )
        self.path = folder / f"{name}.pem"
        self.path.write_bytes(certificate.public_bytes(serialization.Encoding.PEM))

    def issue(
        self,
        name: str,
        role: bytes | None = None,
        lifetime: timedelta = timedelta(days=1),
        password: bytes | None = None,
    ) -> Credentials:
        """Sign a certificate for a name, with the DER of a role; trusts the same authority."""
        key = ec.generate_private_key(ec.SECP256R1())
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        names = x509.SubjectAlternativeName([x509.DNSName(name), x509.IPAddress(ipaddress.ip_address("127.0.0.1"))])
        builder = self._builder(subject, key, lifetime).add_extension(names, critical=False)
        if role is not None:
            builder = builder.add_extension(x509.UnrecognizedExtension(ROLE, role), critical=False)
        certificate, key_file = self._folder / f"{name}.pem", self._folder / f"{name}.key"
        certificate.write_bytes(builder.sign(self._key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM))
        hidden = serialization.NoEncryption() if password is None else serialization.BestAvailableEncryption(password)
        encoding, form = serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8
        key_file.write_bytes(key.private_bytes(encoding, form, hidden))
        return Credentials(self.path, certificate, key_file)

    def _builder(
        self, subject: x509.Name, key: ec.EllipticCurvePrivateKey, lifetime: timedelta
    ) -> x509.CertificateBuilder:
        ends = datetime.now(UTC) + lifetime
        return (
            x509.CertificateBuilder()
            .subject_name(subject)
            .issuer_name(self._name)
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(ends - timedelta(days=30))
            .not_valid_after(ends)
        )


needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")

TIMEOUT_S = 30.0


@contextmanager
def openssl_server(credentials: Credentials, *options: str) -> Iterator[int]:
    """Serve TLS on a free loopback port, demanding a client certificate; yields the port."""
    port = free_port()
    command = ["openssl", "s_server", "-accept", f"127.0.0.1:{port}", "-quiet", "-Verify", "1", "-verify_return_error"]
    files = ["-CAfile", credentials.ca, "-cert", credentials.certificate, "-key", credentials.key]
    with subprocess.Popen(
        [*command, *map(str, files), *options],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as server:
        try:
            _wait_for(port)
            yield port
        finally:
            server.kill()


def openssl_exchange(port: int, credentials: Credentials, request: bytes, *options: str) -> bytes:
    """Send bytes over TLS and return what comes back first; nothing if there is no connection."""
    command = ["openssl", "s_client", "-connect", f"127.0.0.1:{port}", "-quiet", "-verify_return_error"]
    files = ["-CAfile", credentials.ca, "-cert", credentials.certificate, "-key", credentials.key]
    with subprocess.Popen(
        [*command, *map(str, files), *options], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as client:
        try:
            assert client.stdin is not None
            assert client.stdout is not None
            client.stdin.write(request)
            client.stdin.flush()
            got, _, _ = select.select([client.stdout], [], [], TIMEOUT_S)
            assert got, f"neither an answer nor an end within {TIMEOUT_S} s"
            return os.read(client.stdout.fileno(), 260)
        finally:
            client.kill()


def _wait_for(port: int) -> None:
    deadline_s = time.monotonic() + TIMEOUT_S
    while time.monotonic() < deadline_s:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.02)
    raise AssertionError(f"nothing listens on port {port} after {TIMEOUT_S} s")
