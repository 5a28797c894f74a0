"""Certificates as files and as bytes: roles read out of them, and files that can't be used named."""

import ssl
from dataclasses import replace
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from drivers.errors import ConfigMismatch
from drivers.plc.modbus_security import Credentials, client_context, own_role, role_of, server_context, tls_failure
from tests.wire.tls_peers import Authority, der_text


def der_of(credentials: Credentials) -> bytes:
    return x509.load_pem_x509_certificate(credentials.certificate.read_bytes()).public_bytes(Encoding.DER)


@pytest.mark.parametrize("role", ["operator", "Prüfer", "r" * 127])
def test_the_role_is_the_text_of_the_extension(role: str, tmp_path: Path) -> None:
    credentials = Authority(tmp_path).issue("client", der_text(role))
    assert role_of(der_of(credentials)) == role
    assert own_role(credentials) == role


@pytest.mark.parametrize(
    "role", [None, b"", b"operator", der_text("operator", 0x13), b"\x0c\x08opera", b"\x0c\x01\xff"]
)
def test_what_is_no_utf8_string_is_no_role(role: bytes | None, tmp_path: Path) -> None:
    assert role_of(der_of(Authority(tmp_path).issue("client", role))) is None


@pytest.mark.parametrize("context", [client_context, server_context])
def test_both_sides_want_a_certificate_and_tls_1_2(context: type, tmp_path: Path) -> None:
    made: ssl.SSLContext = context(Authority(tmp_path).issue("either"))
    assert made.verify_mode is ssl.CERT_REQUIRED
    assert made.minimum_version is ssl.TLSVersion.TLSv1_2
    assert made.check_hostname is (context is client_context)


@pytest.mark.parametrize("missing", ["ca", "certificate", "key"])
def test_a_file_that_is_not_there_is_named(missing: str, tmp_path: Path) -> None:
    credentials = replace(Authority(tmp_path).issue("client"), **{missing: tmp_path / "gone.pem"})
    with pytest.raises(ConfigMismatch, match=r"gone\.pem.*expected PEM files .*, got: No such file"):
        client_context(credentials)


def test_a_key_with_a_password_is_refused_and_nobody_is_asked(tmp_path: Path) -> None:
    hidden = Authority(tmp_path).issue("client", password=b"secret")
    with pytest.raises(ConfigMismatch, match="expected a private key without a password"):
        client_context(hidden)


@pytest.mark.parametrize(
    ("cause", "said"),
    [
        (None, "nothing that is TLS"),
        (TimeoutError(), "nothing that is TLS"),
        (ConnectionResetError(), "closed without a word"),
        (ssl.SSLError(1, "what OpenSSL has no reason for"), "the handshake failed .*no reason for"),
    ],
)
def test_a_failure_without_a_known_reason_is_reported_as_it_came(cause: Exception | None, said: str) -> None:
    failure = tls_failure("PLC at 127.0.0.1:802", cause)
    with pytest.raises(ConfigMismatch, match=f"^PLC at 127.0.0.1:802: expected a TLS connection .*got: .*{said}"):
        raise failure
