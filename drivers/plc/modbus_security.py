"""Modbus/TCP Security: TLS 1.2 or newer, a certificate on both sides, and the role in the client's own.

The protocol inside the TLS connection is Modbus TCP as it is. Who may do what is decided by the server, from the
role in the client's certificate: an X.509v3 extension, one UTF8String, that only the certificate authority can put
there. Source: MODBUS/TCP Security Protocol Specification v2.1 (2018), "mbaps", registered port 802.
"""

from __future__ import annotations

import ssl
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from cryptography import x509
from cryptography.hazmat import asn1

from drivers.errors import ConfigMismatch
from drivers.foreign_file import read_regular, require_regular

ROLE_OID: Final = x509.ObjectIdentifier("1.3.6.1.4.1.50316.802.1")  # object identifier of the role extension
OLDEST_TLS: Final = ssl.TLSVersion.TLSv1_2  # anything older is refused in the handshake, on both sides

_VERIFY_TEXT: Final[Mapping[int, str]] = MappingProxyType(
    {
        9: "its certificate is not valid yet: compare the clocks of both machines",
        10: "its certificate has expired: renew it, or compare the clocks of both machines",
        18: "its certificate is self-signed, not signed by the authority of 'ca'",
        19: "its certificate is not signed by the authority of 'ca'",
        20: "its certificate is not signed by the authority of 'ca'",
        21: "its certificate is not signed by the authority of 'ca'",
        62: "its certificate is for another name: set server_name to the name in it, if it is the right PLC",
        64: "its certificate is for another address: set server_name to the name in it, if it is the right PLC",
    }
)
"""What OpenSSL's verification codes mean here, where the server's certificate is refused by the client."""

_REASON_TEXT: Final[Mapping[str, str]] = MappingProxyType(
    {
        "TLSV13_ALERT_CERTIFICATE_REQUIRED": "it requires a client certificate and got none",
        "SSLV3_ALERT_HANDSHAKE_FAILURE": "it refuses the handshake: it may want another client certificate or cipher",
        "SSLV3_ALERT_CERTIFICATE_EXPIRED": "it says that this client's certificate has expired: renew it",
        "SSLV3_ALERT_CERTIFICATE_REVOKED": "it says that this client's certificate is revoked",
        "SSLV3_ALERT_BAD_CERTIFICATE": "it does not accept this client's certificate",
        "SSLV3_ALERT_UNSUPPORTED_CERTIFICATE": "it says that this client's certificate is not one for clients",
        "TLSV1_ALERT_UNKNOWN_CA": "it does not know the authority that signed this client's certificate",
        "TLSV1_ALERT_PROTOCOL_VERSION": "it does not take TLS 1.2 or newer: update its firmware",
        "UNSUPPORTED_PROTOCOL": "it offers only a TLS older than 1.2: update its firmware",
        "WRONG_SSL_VERSION": "it offers only a TLS older than 1.2: update its firmware",
        "WRONG_VERSION_NUMBER": "what answers there is not TLS: is it the port of plain Modbus TCP?",
    }
)
"""What OpenSSL's reasons mean; a PLC that refuses says so in an alert."""


@dataclass(frozen=True, slots=True)
class Credentials:
    """What one side shows and what it trusts: paths of PEM files."""

    ca: Path  # certificate of the authority that must have signed the other side's certificate
    certificate: Path  # its own
    key: Path  # the certificate's private key


@dataclass(frozen=True, slots=True)
class ClientSecurity:
    """How a client secures its connection; without ``server_name`` the certificate must name the host."""

    credentials: Credentials  # of this host
    server_name: str | None = None


def client_context(credentials: Credentials) -> ssl.SSLContext:
    """Build what a client connects with: it verifies the server's certificate and name, and shows its own."""
    return _context(ssl.PROTOCOL_TLS_CLIENT, credentials)


def server_context(credentials: Credentials) -> ssl.SSLContext:
    """Build what a server listens with: a client without a certificate of the authority gets no connection."""
    context = _context(ssl.PROTOCOL_TLS_SERVER, credentials)
    context.verify_mode = ssl.CERT_REQUIRED
    return context


def role_of(certificate_der: bytes) -> str | None:
    """Return the role in a certificate's extension (Modbus/TCP Security, OID 1.3.6.1.4.1.50316.802.1); None without."""
    return _role(x509.load_der_x509_certificate(certificate_der))


def own_role(credentials: Credentials) -> str | None:
    """Read the role out of a side's own certificate file; see `role_of`."""
    return _role(x509.load_pem_x509_certificate(read_regular(credentials.certificate)))


def _role(certificate: x509.Certificate) -> str | None:
    try:
        role = certificate.extensions.get_extension_for_oid(ROLE_OID).value
        return asn1.decode_der(str, role.public_bytes())
    except (x509.ExtensionNotFound, x509.DuplicateExtension, ValueError):
        return None


def tls_failure(place: str, cause: Exception | None) -> ConfigMismatch:
    """Put into words for a person at the rig why a TLS connection did not come about, or not for long."""
    return ConfigMismatch(
        f"{place}: expected a TLS connection with certificates that both sides accept, got: {_cause_text(cause)}. "
        "Look at [plc.security] of the rig file and at the PLC's own settings."
    )


def _cause_text(cause: Exception | None) -> str:
    if isinstance(cause, ssl.SSLError):
        reason = getattr(cause, "reason", None)  # there only where OpenSSL itself raised it
        text = _VERIFY_TEXT.get(getattr(cause, "verify_code", 0)) or _REASON_TEXT.get(reason or "")
        detail = getattr(cause, "verify_message", None) or reason or str(cause)
        return f"{text or 'the handshake failed'} ({detail})"
    if cause is None or isinstance(cause, TimeoutError):
        return "nothing that is TLS: is it the port of plain Modbus TCP? That of Modbus/TCP Security often is 802"
    return (
        "the connection closed without a word, as by a PLC that does not accept this client's certificate (its "
        "authority, its dates), or that does not speak TLS 1.2 or newer"
    )


def _context(protocol: ssl._SSLMethod, credentials: Credentials) -> ssl.SSLContext:
    context = ssl.SSLContext(protocol)
    context.minimum_version = OLDEST_TLS
    _load("ca", [credentials.ca], lambda: context.load_verify_locations(credentials.ca))
    _load(
        "certificate and key",
        [credentials.certificate, credentials.key],
        lambda: context.load_cert_chain(credentials.certificate, credentials.key, _no_password),
    )
    return context


def _load(what: str, files: Sequence[Path], load: Callable[[], None]) -> None:
    try:
        for file in files:
            require_regular(file)
        load()
    except OSError as cause:  # ssl.SSLError is one
        reason = getattr(cause, "reason", None) or cause.strerror or str(cause)
        raise ConfigMismatch(
            f"{what} ({', '.join(map(str, files))}): expected PEM files that belong together, got: {reason}. "
            "Look at the paths in the rig file, and make the files again."
        ) from cause


def _no_password() -> str:
    """Stand in for OpenSSL's question at the terminal, which nobody would answer."""
    raise ConfigMismatch("key: expected a private key without a password, got an encrypted one. Decrypt it first.")
