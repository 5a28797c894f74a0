"""Other people's TLS: ``openssl s_server`` as a PLC that refuses, ``openssl s_client`` as a Modbus client."""

from __future__ import annotations

import os
import select
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from drivers.plc.modbus_security import Credentials
from tests.drivers.modbus_peers import free_port

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
        [*command, *map(str, files), *options],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
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
